// How the page's scripts are written. Names that stand nowhere are found by the type checker.

import js from "@eslint/js";

export default [
  { ignores: ["page/vendor/"] },
  js.configs.recommended,
  {
    rules: {
      "no-undef": "off",
      "no-var": "error",
      "prefer-const": "error",
      "prefer-template": "error",
      "object-shorthand": "error",
      "arrow-body-style": "error",
      eqeqeq: "error",
      "no-else-return": "error",
      "no-implicit-coercion": "error",
      "no-unneeded-ternary": "error",
      "no-useless-rename": "error",
      "no-template-curly-in-string": "error",
      "no-promise-executor-return": "error",
      "no-console": "error",
    },
  },
  { files: ["checks/**"], rules: { "no-console": "off" } },
];
