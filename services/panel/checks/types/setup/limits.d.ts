// `setup/limits.js`, which the panel makes (`LIMITS` in src/page.rs).

export const LIMITS: { squares: number; leastSideCm: number; mostSideCm: number; goods: number };
