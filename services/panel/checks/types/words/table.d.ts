// `words/table.js`, which the panel makes of the table of sentences and the limits of a floor
// (`TABLE` in src/page.rs).

export const TABLE: Record<string, { en: string; sv: string } | undefined>;
export const LIMITS: { squares: number; leastSideCm: number; mostSideCm: number; goods: number };
