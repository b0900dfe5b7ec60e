// `commission/sentences.js`, which the panel makes (`COMMISSION` in src/page.rs).

export const SENTENCES: Record<"en" | "sv", Record<string, string>>;
