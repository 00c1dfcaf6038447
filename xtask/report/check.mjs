// Opens every report of a folder in a headless browser, as a reader does: wide and narrow, light, dark and on paper. Ends with an
// error where the console says one, where axe-core finds a violation, where something that can be operated is not reached with the
// Tab key or does nothing, where the page is wider than the screen, and where a script from a file has run.
//
//   node check.mjs FOLDER SCREENSHOTS BROWSER
import { mkdirSync, readFileSync, readdirSync } from "node:fs";
import { basename, join, resolve } from "node:path";
import { accessible, fail, fitsItsScreen, opened, withBrowser } from "../browser.mjs";

const [folder, screenshots, browserPath] = process.argv.slice(2).map((path) => resolve(path));
const SIZES = [["wide", 1280, 900], ["narrow", 400, 800]];
const SCHEMES = ["light", "dark"];
const OPERABLE = "a[href], button, input, summary, [tabindex='0']";

mkdirSync(screenshots, { recursive: true });
await withBrowser(browserPath, async (context) => {
  for (const file of readdirSync(folder).filter((name) => name.endsWith(".html")).sort()) await check(context, file);
});

async function check(context, file) {
  const name = basename(file, ".html");
  for (const [size, width, height] of SIZES) {
    for (const scheme of SCHEMES) {
      const where = `${name} ${size} ${scheme}`;
      const page = await opened(context, join(folder, file), where, { width, height, scheme });
      await page.waitForTimeout(300);
      if (await page.evaluate(() => "ran" in window)) fail(where, "a script from the file has run");
      await fitsItsScreen(page, where);
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
