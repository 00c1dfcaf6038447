// What the scripts that drive a browser share: Chromium without a network, axe-core, and what no page may do.
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const require = createRequire(pathToFileURL(join(process.cwd(), "package.json")));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

const failures = [];
export function fail(where, text) {
  failures.push(`${where}: ${text}`);
  console.error(`FAILED ${where}: ${text}`);
}

// Runs `work` with a browser of a profile of its own, and ends the process with an error where something failed.
export async function withBrowser(executablePath, work) {
  const profile = mkdtempSync(join(tmpdir(), "twinlag-browser-"));
  const context = await chromium.launchPersistentContext(profile, {
    executablePath, headless: true, acceptDownloads: true,
    args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
      "--disable-component-update", "--disable-sync"],
  });
  try {
    await work(context);
  } finally {
    await context.close();
    rmSync(profile, { recursive: true, force: true });
  }
  if (failures.length > 0) {
    console.error(`${failures.length} failures`);
    process.exit(1);
  }
}

// A page with a file open in it. What the console warns of, a script's error, a dialog and a request beyond the file are failures.
export async function opened(context, file, where, { width, height, scheme }) {
  const page = await context.newPage();
  page.on("console", (message) => { if (["error", "warning"].includes(message.type())) fail(where, `console: ${message.text()}`); });
  page.on("pageerror", (error) => fail(where, `script: ${error.message}`));
  page.on("dialog", (dialog) => { fail(where, `a dialog: ${dialog.message()}`); dialog.dismiss(); });
  page.on("request", (request) => { if (!/^(file|data|blob|about):/.test(request.url())) fail(where, `asks for ${request.url()}`); });
  await page.setViewportSize({ width, height });
  await page.emulateMedia({ colorScheme: scheme });
  await page.goto(pathToFileURL(file).href);
  return page;
}

export async function fitsItsScreen(page, where) {
  const overflow = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  if (overflow > 0) fail(where, `is ${overflow} px wider than the screen`);
}

export async function accessible(page, where) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  for (const { id, help, nodes } of violations)
    fail(where, `axe: ${id}: ${help}: ${nodes.slice(0, 3).map((node) => node.html.slice(0, 160)).join(" | ")}`);
}
