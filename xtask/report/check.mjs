// Opens every report of a folder in a headless browser, as a reader does: wide and narrow, light, dark and on paper. Ends with an
// error where the console says one, where axe-core finds a violation, where something that can be operated is not reached with the
// Tab key or does nothing, where the page is wider than the screen, and where a script from a file has run.
//
//   node check.mjs FOLDER SCREENSHOTS BROWSER
import { mkdtempSync, mkdirSync, readdirSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, join, resolve } from "node:path";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const [folder, screenshots, browserPath] = process.argv.slice(2).map((path) => resolve(path));
const require = createRequire(pathToFileURL(join(process.cwd(), "package.json")));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const SIZES = [["wide", 1280, 900], ["narrow", 400, 800]];
const SCHEMES = ["light", "dark"];
const OPERABLE = "a[href], button, input, summary, [tabindex='0']";
const failures = [];
const fail = (page, text) => { failures.push(`${page}: ${text}`); console.error(`FAILED ${page}: ${text}`); };

mkdirSync(screenshots, { recursive: true });
const profile = mkdtempSync(join(tmpdir(), "twinlag-report-"));
const context = await chromium.launchPersistentContext(profile, {
  executablePath: browserPath, headless: true, acceptDownloads: true,
  args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync"],
});
try {
  for (const file of readdirSync(folder).filter((name) => name.endsWith(".html")).sort()) await check(file);
} finally {
  await context.close();
  rmSync(profile, { recursive: true, force: true });
}
if (failures.length > 0) {
  console.error(`${failures.length} failures`);
  process.exit(1);
}

async function check(file) {
  const name = basename(file, ".html");
  for (const [size, width, height] of SIZES) {
    for (const scheme of SCHEMES) {
      const where = `${name} ${size} ${scheme}`;
      const page = await context.newPage();
      page.on("console", (message) => { if (["error", "warning"].includes(message.type())) fail(where, `console: ${message.text()}`); });
      page.on("pageerror", (error) => fail(where, `script: ${error.message}`));
      page.on("dialog", (dialog) => { fail(where, `a dialog: ${dialog.message()}`); dialog.dismiss(); });
      page.on("request", (request) => { if (!/^(file|data|blob):/.test(request.url())) fail(where, `asks for ${request.url()}`); });
      await page.setViewportSize({ width, height });
      await page.emulateMedia({ colorScheme: scheme });
      await page.goto(pathToFileURL(join(folder, file)).href);
      await page.waitForTimeout(300);
      if (await page.evaluate(() => "ran" in window)) fail(where, "a script from the file has run");
      const overflow = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
      if (overflow > 0) fail(where, `is ${overflow} px wider than the screen`);
      await page.screenshot({ path: join(screenshots, `${name}-${size}-${scheme}.png`) });
      await page.screenshot({ path: join(screenshots, `${name}-${size}-${scheme}-whole.png`), fullPage: true });
      await accessible(page, where);
      if (scheme === "light") {
        await keyboard(page, where);
        if (size === "wide") await enlarge(page, where, name);
      }
      if (size === "wide" && scheme === "light") {
        await page.emulateMedia({ media: "print", colorScheme: "dark" });
        await page.pdf({ path: join(screenshots, `${name}.pdf`), format: "A4", printBackground: true });
        await page.setViewportSize({ width: 794, height: 1123 });
        await page.screenshot({ path: join(screenshots, `${name}-print.png`) });
        const live = await page.evaluate(() => [...document.querySelectorAll(".live, .data")].some((e) => e.offsetParent !== null));
        if (live) fail(where, "what can only be operated is printed");
      }
      await page.close();
      console.log(`checked ${where}`);
    }
  }
}

async function accessible(page, where) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  for (const { id, help, nodes } of violations)
    fail(where, `axe: ${id}: ${help}: ${nodes.slice(0, 3).map((node) => node.html.slice(0, 160)).join(" | ")}`);
}

// Tab goes through everything that can be operated, in the order of the page.
async function keyboard(page, where) {
  const count = await page.evaluate((operable) => {
    const all = [...document.querySelectorAll(operable)].filter((e) => e.checkVisibility({ contentVisibilityAuto: true }));
    all.forEach((e, k) => { e.dataset.place = k; });
    document.activeElement?.blur();
    return all.length;
  }, OPERABLE);
  const reached = new Set();
  for (let k = 0; k < count + 2; k++) {
    await page.keyboard.press("Tab");
    const place = await page.evaluate(() => document.activeElement?.dataset.place ?? null);
    if (place === null) continue;
    const outline = await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle);
    if (outline === "none") fail(where, `the focus is not seen at ${place}`);
    reached.add(place);
  }
  if (reached.size !== count) {
    const missed = await page.evaluate((places) => [...document.querySelectorAll("[data-place]")]
      .filter((e) => !places.includes(e.dataset.place)).map((e) => e.outerHTML.slice(0, 120)), [...reached]);
    fail(where, `Tab reaches ${reached.size} of ${count}; not ${missed.join(" | ")}`);
  }
}

// The first plot is enlarged with a key, moved, and shown whole again; with a button as well; its data are there to be saved.
async function enlarge(page, where, name) {
  const link = page.locator("a[download]").first();
  if (await link.count()) {
    const [download] = await Promise.all([page.waitForEvent("download"), link.click()]);
    const text = readFileSync(await download.path(), "utf8");
    if (!text.startsWith("panel,series,x,y,low,high\n") || text.split("\n").length < 3) fail(where, "the data of a figure are no table");
  }
  const plot = page.locator(".plot").first();
  if (!(await plot.count())) {
    if (!name.includes("static")) fail(where, "nothing can be enlarged");
    if (await page.locator("script").count()) fail(where, "a static page has a script");
    return;
  }
  const shown = () => page.locator(".live output").first().textContent();
  const whole = await shown();
  await plot.focus();
  await page.keyboard.press("+");
  const larger = await shown();
  if (larger === whole) fail(where, "the plus key does nothing");
  await page.keyboard.press("ArrowRight");
  if ((await shown()) === larger) fail(where, "the arrow key does nothing");
  await page.keyboard.press("0");
  if ((await shown()) !== whole) fail(where, "the 0 key does not show all");
  for (const title of ["Enlarge", "Move right"]) {
    const before = await shown();
    await page.locator(`.live button[title="${title}"]`).first().press("Enter");
    if ((await shown()) === before) fail(where, `the button ${title} does nothing`);
  }
  await plot.scrollIntoViewIfNeeded();
  await page.screenshot({ path: join(screenshots, `${name}-enlarged.png`) });
  const box = page.locator(".live input[type=checkbox]").first();
  if (await box.count()) {
    await box.press("Space");
    if (await box.isChecked()) fail(where, "the box of a trace does nothing");
  }
}
