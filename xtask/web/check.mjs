// Drives the page as a person does: files are dropped on it, columns chosen, records diagnosed. Ends with an error where an answer differs
// from the program's, where the page asks the network for anything, where the console says an error, where axe-core finds a violation,
// where the page is wider than the screen, and where a script from a file has run.
//
//   node check.mjs PAGE RECORDS SCREENSHOTS BROWSER PROGRAM
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { accessible, fail, fitsItsScreen, opened, withBrowser } from "../browser.mjs";

const [pagePath, records, screenshots, browserPath, program] = process.argv.slice(2).map((path) => resolve(path));
// Numbers of two kinds of processor differ in their last digits.
const RELATIVE = 1e-9;
// Of a gas temperature, in its standard deviations: what the gas is like is searched for, and where its parts go together closely, the last
// digits of the browser's exponentials move it: by 3.8e-6 in these records.
const GAS_RELATIVE = 1e-5;
const DESK = { width: 1280, height: 900, scheme: "light" };
const PHONE = { width: 400, height: 800, scheme: "light" };
// Of a million rows, which a reader may ask for by --rows.
const DIAGNOSED_MS = 3_600_000;

await withBrowser(browserPath, async (context) => {
  const open = (where, look = DESK) => opened(context, pagePath, where, look);
  await looks(open);
  await answers(open, "one record", ["first.csv"]);
  await answers(open, "two records", ["first.csv", "second.csv"]);
  writeFileSync(join(records, "first.npy"), structured(readFileSync(join(records, "first.csv"), "utf8")));
  await answers(open, "a binary file", ["first.npy"]);
  await columns(open);
  await groups(open);
  await nasty(open);
  await stops(open);
  await unreadable(open);
  await takes(open);
});

// A table as NumPy saves an array with named columns.
function structured(csv) {
  const [names, ...rows] = csv.trim().split("\n").map((line) => line.split(","));
  const columns = names.map((name) => `('${name}', '<f8')`).join(", ");
  const header = `{'descr': [${columns}], 'fortran_order': False, 'shape': (${rows.length},), }`;
  const padded = `${header.padEnd(Math.ceil((header.length + 11) / 64) * 64 - 11)}\n`;
  const length = Buffer.alloc(2);
  length.writeUInt16LE(padded.length);
  const numbers = Float64Array.from(rows.flat(), Number);
  return Buffer.concat([Buffer.from("\x93NUMPY\x01\x00", "latin1"), length, Buffer.from(padded), Buffer.from(numbers.buffer)]);
}

// Drops files, as a person does.
async function drop(page, names) {
  const files = names.map((name) => ({ name, base64: readFileSync(join(records, name)).toString("base64") }));
  const data = await page.evaluateHandle((files) => {
    const transfer = new DataTransfer();
    for (const { name, base64 } of files) transfer.items.add(new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], name));
    return transfer;
  }, files);
  await page.dispatchEvent("#drop", "drop", { dataTransfer: data });
  await page.waitForSelector("#asking:not([hidden])", { timeout: 60_000 });
}

async function downloaded(page, title) {
  const [download] = await Promise.all([page.waitForEvent("download"), page.click(`.links a:text-is("${title}")`)]);
  return readFileSync(await download.path(), "utf8");
}

async function diagnosed(page) {
  await page.click("#diagnose");
  await page.waitForFunction(() => document.getElementById("said").textContent !== "", null, { timeout: DIAGNOSED_MS });
  const said = await page.textContent("#said");
  if (said !== "Diagnosed.") throw new Error(said);
  // Failed: from the second answer on the frame of the report was blank.
  const box = await page.frameLocator("#answer-report").locator("h1").boundingBox();
  if (!(box?.width > 0)) throw new Error("the report is blank");
}

function run(...details) {
  return execFileSync(program, [...details, "--quiet"], { cwd: records, encoding: "utf8", maxBuffer: 1 << 28 });
}

// All that differs between two answers.
function differences(one, other, at = "") {
  if (typeof one === "number" && typeof other === "number") {
    return Math.abs(one - other) <= RELATIVE * Math.max(Math.abs(one), Math.abs(other)) ? [] : [`${at}: ${one} and ${other}`];
  }
  if (one === null || other === null || typeof one !== "object" || typeof other !== "object") {
    return one === other ? [] : [`${at}: ${JSON.stringify(one)} and ${JSON.stringify(other)}`];
  }
  const keys = new Set([...Object.keys(one), ...Object.keys(other)]);
  return [...keys].flatMap((key) => differences(one[key], other[key], `${at}.${key}`));
}

// How far two rows of a gas temperature are apart, in its standard deviations.
function farthest([time, gas, std], [otherTime, otherGas, otherStd]) {
  return Math.max(Math.abs(gas - otherGas), Math.abs(std - otherStd)) / otherStd + (time === otherTime ? 0 : Infinity);
}

async function answers(open, where, names) {
  const page = await open(where);
  await drop(page, names);
  await diagnosed(page);
  const said = JSON.parse(await downloaded(page, "Answer as JSON"));
  const wanted = JSON.parse(run("diagnose", ...names, "--json"));
  differences(said, wanted).forEach((text) => fail(where, text));
  const report = await downloaded(page, "Report");
  if (!report.startsWith("<!DOCTYPE html>") || !report.includes("Content-Security-Policy")) fail(where, "the report is none");
  await page.click("#compensate");
  await page.waitForFunction(() => document.getElementById("said").textContent !== "", null, { timeout: 600_000 });
  const done = await page.textContent("#said");
  if (done !== "The gas temperature is reconstructed.") fail(where, done);
  if (names.length === 1) {
    const gas = (await downloaded(page, "Gas temperature as CSV")).trim().split("\n").map((line) => line.split(","));
    run("diagnose", names[0], "--save", "model.json", "--force");
    run("compensate", names[0], "--model", "model.json", "--out", "gas.csv", "--force");
    const wanted = readFileSync(join(records, "gas.csv"), "utf8").trim().split("\n").map((line) => line.split(","));
    // The header, then the grade and what is kept of the file.
    const words = (rows) => [rows[0], ...rows.slice(1).map((row) => row.slice(3))].join("\n");
    if (words(gas) !== words(wanted)) fail(where, `gas: ${gas[0]} and ${wanted[0]}, or what is behind the numbers`);
    if (gas.length !== wanted.length) {
      fail(where, `the gas has ${gas.length} rows, by the program ${wanted.length}`);
      return page.close();
    }
    const apart = Math.max(...gas.slice(1).map((row, k) => farthest(row.slice(0, 3).map(Number), wanted[k + 1].slice(0, 3).map(Number))));
    console.log(`== ${where}: the gas within ${apart.toExponential(1)} of its standard deviation`);
    if (!(apart <= GAS_RELATIVE)) fail(where, `the gas differs by ${apart} of its standard deviation`);
  }
  await page.close();
  console.log(`== ${where}: as the program`);
}

// A wrong choice is said, and a right one mends it; what is known is of the first or the second sensor, whatever its column is called.
async function columns(open) {
  const where = "columns";
  const page = await open(where);
  await drop(page, ["first.csv"]);
  const names = await page.$$eval("#t1 option", (options) => options.map((option) => option.value));
  const [t1, t2] = ["T1", "T2"].map((sensor) => names.find((name) => name.startsWith(`"${sensor}`)));
  await page.selectOption("#t1", t1);
  await page.selectOption("#t2", t1);
  await page.waitForSelector("#read .warning");
  if (await page.isVisible("#diagnose")) fail(where, "two sensors in one column are diagnosed");
  await page.selectOption("#t2", t2);
  await page.waitForSelector("#asking:not([hidden])");
  await diagnosed(page);
  const given = [
    [{ "known-t1": "0.12 s" }, ["--known", "T1=0.12s"]],
    [{ "known-t1": "", "known-t2": "450 ms ± 5 %", noise: "0,1 0,1" }, ["--known", "T2=0.45+-0.0225", "--noise", "0.1,0.1"]],
  ];
  for (const fields of [{ "known-t1": "T2 = 0.12" }, { "known-t1": "", noise: "0.3" }]) {
    for (const [id, text] of Object.entries(fields)) await page.fill(`#${id}`, text);
    await page.click("#diagnose");
    await page.waitForSelector("#said:not(:empty)");
    if (await page.isVisible("#answer")) fail(where, `${JSON.stringify(fields)} is answered`);
  }
  await page.fill("#noise", "");
  for (const [fields, options] of given) {
    for (const [id, text] of Object.entries(fields)) await page.fill(`#${id}`, text);
    if (await page.isVisible("#answer")) fail(where, "an answer stays that is not of what is asked");
    await diagnosed(page);
    const said = JSON.parse(await downloaded(page, "Answer as JSON"));
    const wanted = JSON.parse(run("diagnose", "first.csv", "--t1", JSON.parse(t1), "--t2", JSON.parse(t2), ...options, "--json"));
    differences(said, wanted).forEach((text) => fail(where, text));
  }
  await page.close();
}

// A file whose sensors are in two groups is read when it is said that they are joined.
async function groups(open) {
  const where = "groups";
  const page = await open(where, PHONE);
  await page.setInputFiles("#files", join(records, "apart.mf4"));
  await page.waitForSelector("#read .warning");
  if (await page.isVisible("#diagnose")) fail(where, "one of two groups is taken unasked");
  const read = (text) => page.waitForFunction((text) => document.getElementById("read").textContent.includes(text), text);
  const [, , , joined] = await page.$$eval("#group option", (options) => options.map((option) => option.value));
  await page.selectOption("#group", joined);
  await read("apart.mf4: 18 samples");
  await page.waitForSelector("#asking:not([hidden])");
  await fitsItsScreen(page, where);
  await accessible(page, where);
  await page.screenshot({ path: join(screenshots, "groups-narrow-light.png"), fullPage: true });
  await page.close();
}

async function nasty(open) {
  const where = "a name that is a script";
  const page = await open(where);
  const data = readFileSync(join(records, "nasty.csv"));
  await page.setInputFiles("#files", { name: "nasty.csv", mimeType: "text/csv", buffer: data });
  await page.waitForSelector("#columns:not([hidden])");
  if (await page.isHidden("#asking")) {
    const names = await page.$$eval("#t1 option", (options) => options.map((option) => option.value));
    await page.selectOption("#t1", names.find((name) => name.includes("script")));
    await page.selectOption("#t2", names.find((name) => name.startsWith('"T2')));
    await page.waitForSelector("#asking:not([hidden])");
  }
  await diagnosed(page);
  // The report loads in its frame.
  await page.frameLocator("#answer-report").locator("h1").waitFor();
  for (const frame of page.frames()) if (await frame.evaluate(() => "ran" in window)) fail(where, "it has run");
  await page.close();
}

async function stops(open) {
  const where = "stop";
  const page = await open(where);
  await drop(page, ["long.csv"]);
  await page.click("#diagnose");
  await page.click("#stop");
  await page.waitForFunction(() => document.getElementById("said").textContent === "Stopped.");
  await page.waitForSelector("#asking:not([hidden])");
  // What comes after it works, and a diagnosis stays where its gas temperature is stopped.
  await drop(page, ["first.csv"]);
  await diagnosed(page);
  await page.click("#compensate");
  await page.click("#stop");
  await page.waitForFunction(() => document.getElementById("said").textContent === "Stopped.");
  await page.waitForSelector("#answer:not([hidden])");
  await page.click("#compensate");
  await page.waitForSelector("#gas:not([hidden])", { timeout: 0 });
  // A period that is none holds the diagnosis.
  await page.fill("#period", "abc");
  await page.click("#diagnose");
  await page.waitForSelector("#period:invalid");
  // One that is typed, and the diagnosis asked for at once: it waits for the files to be read anew.
  await page.fill("#period", "500 ms");
  await diagnosed(page);
  if (!(await page.textContent("#read")).includes("one every 0.5 s")) fail("period", await page.textContent("#read"));
  await page.close();
}

async function unreadable(open) {
  const where = "no table";
  const page = await open(where);
  for (const [name, text] of [["empty.csv", ""], ["words.txt", "no table at all"], ["one.csv", "T1\n1\n2\n"], ["nan.csv", "t,a,b\n1,NaN,x\n"]]) {
    await page.setInputFiles("#files", { name, mimeType: "text/plain", buffer: Buffer.from(text) });
    await page.waitForFunction((name) => document.getElementById("read").textContent.includes(name), name);
    if (!(await page.$("#read .warning"))) fail(where, `${name}: nothing is said`);
    if (await page.isVisible("#diagnose")) fail(where, `${name}: it is diagnosed`);
  }
  await page.close();
}

// Measures; the numbers are for a reader.
async function takes(open) {
  const page = await open("long record");
  await drop(page, ["long.csv"]);
  const begun = performance.now();
  await diagnosed(page);
  const inPage = performance.now() - begun;
  const again = performance.now();
  run("diagnose", "long.csv", "--json");
  const byProgram = performance.now() - again;
  console.log(`== long record: ${(inPage / 1000).toFixed(2)} s in the page, ${(byProgram / 1000).toFixed(2)} s by the program`);
  await page.close();
}

async function looks(open) {
  for (const [size, width, height] of [["wide", 1280, 900], ["narrow", 400, 800]]) {
    for (const scheme of ["light", "dark"]) {
      const where = `page ${size} ${scheme}`;
      const page = await open(where, { width, height, scheme });
      await page.screenshot({ path: join(screenshots, `begin-${size}-${scheme}.png`) });
      await page.click("#example");
      await page.waitForSelector("#asking:not([hidden])", { timeout: 60_000 });
      await page.screenshot({ path: join(screenshots, `read-${size}-${scheme}.png`), fullPage: true });
      await diagnosed(page);
      // Of the window: a frame is not drawn in a picture that is longer.
      await page.evaluate(() => document.getElementById("answer").scrollIntoView());
      await page.waitForTimeout(500);
      await page.screenshot({ path: join(screenshots, `answer-${size}-${scheme}.png`) });
      await fitsItsScreen(page, where);
      await accessible(page, where);
      await page.close();
    }
  }
}
