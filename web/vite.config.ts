import { defineConfig } from "vitest/config";

export default defineConfig({
  // Relative addresses: the page works at "/" and below any prefix a proxy adds.
  base: "./",
  build: {
    target: "es2022",
    // Assets stay files, so that a content security policy needs no "data:".
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
  },
  // `npm run dev` serves the page itself and leaves the API to a running fstop.
  server: { proxy: { "/v1": "http://127.0.0.1:8080" } },
  test: { include: ["src/**/*_test.ts"], environment: "node" },
});
