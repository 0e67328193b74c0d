// The page: filters, plots, table and the dialog of one trial, all from one document.
const DATA = JSON.parse(document.getElementById("data").textContent);
const headOf = name => COLUMN[name] ? COLUMN[name].head : DATA.commonHeads[name] || name;
const COLUMN = Object.assign(Object.create(null), Object.fromEntries(DATA.columns.map((column, i) => [column.name, { ...column, index: i }])));
const $ = id => document.getElementById(id);
const PAGE = 100;
const state = { rows: [], sort: DATA.columns[0].name, descending: false, page: 0, shown: new Set(DATA.shown), text: "", picked: {} };
const get = (row, name) => COLUMN[name] ? DATA.rows[row][COLUMN[name].index] : null;
const isNumber = value => typeof value === "number" && Number.isFinite(value);

function element(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) key in node ? node[key] = value : node.setAttribute(key, value);
  node.append(...children);
  return node;
}

function shownValue(value) {
  if (value === null || value === undefined) return "-";
  if (typeof value === "boolean") return value ? "yes" : "no";
  return isNumber(value) && !Number.isInteger(value) ? short(value) : String(value);
}

// Filters ------------------------------------------------------------------------------------------------------
function buildFilters() {
  const form = $("filters");
  form.addEventListener("submit", event => event.preventDefault());
  const search = element("input", { type: "search", id: "search", placeholder: "text in any column", value: state.text });
  search.addEventListener("input", () => { state.text = search.value.toLowerCase(); update(); });
  form.append(element("label", {}, "search", search));
  for (const name of DATA.filters) {
    const values = [...new Set(DATA.rows.map((_, i) => shownValue(get(i, name))))].sort((a, b) => a.localeCompare(b, "en", { numeric: true }));
    const select = element("select", { id: `filter-${name}` }, element("option", { value: "" }, "all"), ...values.map(v => element("option", { value: v }, v)));
    if (values.includes(state.picked[name])) select.value = state.picked[name]; else delete state.picked[name];
    select.addEventListener("change", () => { state.picked[name] = select.value; update(); });
    form.append(element("label", { title: name }, headOf(name), select));
  }
}

function passes(row) {
  for (const [name, value] of Object.entries(state.picked)) if (value && shownValue(get(row, name)) !== value) return false;
  return !state.text || DATA.rows[row].some(value => String(value).toLowerCase().includes(state.text));
}

function update() {
  state.page = 0;
  state.rows = DATA.rows.map((_, i) => i).filter(passes);
  sortRows();
  writeAddress();
  drawSummary();
  drawPlots();
  drawTable();
}

function drawSummary() {
  const counts = {};
  for (const row of state.rows) counts[get(row, "status") ?? DATA.common.status] = (counts[get(row, "status") ?? DATA.common.status] || 0) + 1;
  const known = state.rows.filter(isExecuted), good = known.filter(row => valueOf(row, "success") === true).length, w = wilson(good, known.length);
  $("summary").textContent = `${state.rows.length} of ${DATA.rows.length} trials: ` +
    Object.entries(counts).map(([status, n]) => `${n} ${status}`).join(", ") +
    (known.length ? `; ${short(100 * w.value)} % of ${known.length} succeeded (95 % interval ${short(100 * w.low)} to ${short(100 * w.high)} %)` : "; success is known of none");
}

function isExecuted(row) { return typeof valueOf(row, "success") === "boolean"; }

function valueOf(row, name) { return COLUMN[name] ? get(row, name) : DATA.common[name] ?? null; }

// Plots --------------------------------------------------------------------------------------------------------
const choices = { group: DATA.groups[0], ratio: DATA.strips[0], x: DATA.scatter[0], y: DATA.scatter[1] }, defaults = { ...choices };

function buildPlots() {
  const numbers = DATA.columns.filter(c => c.kind === "number").map(c => c.name);
  for (const [id, title, picks] of [
    ["strip", "Distribution", { ratio: numbers, group: DATA.groups }], ["scatter", "One value against another", { x: numbers, y: numbers }],
    ["success", "Success rate, 95 % intervals", {}], ["times", "Mean time of each stage, s", {}],
  ]) {
    const bar = element("div", { className: "choices" });
    for (const [key, options] of Object.entries(picks)) {
      const select = element("select", { id: `choice-${key}` }, ...options.map(o => element("option", { value: o, selected: o === choices[key] }, headOf(o))));
      select.addEventListener("change", () => { choices[key] = select.value; writeAddress(); drawPlots(); });
      bar.append(element("label", { className: "choice" }, { ratio: "value", group: "by" }[key] || key, select));
    }
    const save = element("div", { className: "save" });
    for (const [kind, content] of [["svg", () => standalone($(`plot-${id}`).querySelector("svg"))], ["csv", () => csvOf(drawn[id])]]) {
      const button = element("button", { type: "button", id: `save-${id}-${kind}`, title: `Save as ${kind.toUpperCase()}` }, kind.toUpperCase());
      button.addEventListener("click", () => { const text = content(); if (text) download(`${id}.${kind}`, text, kind); });
      save.append(button);
    }
    $("plots").append(element("div", { className: "card" }, element("div", { className: "head" }, element("h3", {}, title), save), bar, element("div", { id: `plot-${id}` })));
  }
  $("plots").addEventListener("click", event => { const row = event.target.dataset && event.target.dataset.row; if (row) openTrial(+row); });
}

function grouped(name) {
  const groups = new Map();
  for (const row of state.rows) {
    const key = shownValue(valueOf(row, name));
    groups.has(key) || groups.set(key, []);
    groups.get(key).push(row);
  }
  return [...groups].sort((a, b) => a[0].localeCompare(b[0], "en", { numeric: true })).slice(0, 40);
}

const drawn = {};  // what each plot shows, as rows

function download(name, text, kind) {
  const url = URL.createObjectURL(new Blob([text], { type: kind === "svg" ? "image/svg+xml" : "text/csv" }));
  const link = element("a", { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}

function csvOf(rows) {
  if (!rows || !rows.length) return "";
  const cell = value => {
    if (value === null || value === undefined) return "";
    const text = typeof value === "string" && /^[=+\-@\t\r]/.test(value) ? "'" + value : String(value);
    return /[",\n\r]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  };
  return [Object.keys(rows[0]), ...rows.map(row => Object.values(row))].map(line => line.map(cell).join(",")).join("\n") + "\n";
}

// The address keeps filters and choices, also of a file --------------------------------------------------------
function readAddress() {
  const given = new URLSearchParams(location.hash.slice(1));
  state.text = (given.get("search") || "").toLowerCase();
  for (const name of DATA.filters) if (given.has(name)) state.picked[name] = given.get(name);
  const numbers = DATA.columns.filter(c => c.kind === "number").map(c => c.name);
  for (const [key, offered] of [["group", DATA.groups], ["ratio", numbers], ["x", numbers], ["y", numbers]])
    if (offered.includes(given.get(`plot.${key}`))) choices[key] = given.get(`plot.${key}`);
  if (COLUMN[given.get("sort")]) { state.sort = given.get("sort"); state.descending = given.has("descending"); }
}

function writeAddress() {
  const kept = new URLSearchParams();
  if (state.text) kept.set("search", state.text);
  for (const [name, value] of Object.entries(state.picked)) if (value) kept.set(name, value);
  for (const [key, value] of Object.entries(choices)) if (value !== defaults[key]) kept.set(`plot.${key}`, value);
  if (state.sort !== DATA.columns[0].name) kept.set("sort", state.sort);
  if (state.descending) kept.set("descending", "");
  history.replaceState(null, "", `#${kept}`);
}

function drawPlots() {
  const groups = grouped(choices.group), keys = groups.map(g => g[0]), by = choices.group;
  drawn.strip = groups.flatMap(([key, rows]) => rows.filter(r => isNumber(get(r, choices.ratio))).map(r => ({ trial_id: get(r, "trial_id"), [by]: key, [choices.ratio]: get(r, choices.ratio) })));
  $("plot-strip").innerHTML = stripPlot(groups.map(([key, rows]) => ({ key, values: rows.map(r => get(r, choices.ratio)).filter(isNumber) })));
  const rates = groups.map(([key, rows]) => ({ key, count: rows.filter(isExecuted).length, successes: rows.filter(r => valueOf(r, "success") === true).length })).filter(g => g.count);
  drawn.success = rates.map(g => { const w = wilson(g.successes, g.count); return { [by]: g.key, successes: g.successes, trials: g.count, rate: w.value, low: w.low, high: w.high }; });
  $("plot-success").innerHTML = rates.length ? ratePlot(rates) : "<p class='hint'>nothing was executed</p>";
  drawn.times = DATA.columns.filter(c => c.name.startsWith("times_s.")).map(c => {
    const values = state.rows.map(r => get(r, c.name)).filter(isNumber);
    return { key: c.name.slice(8).replaceAll("_", " "), mean: values.reduce((a, b) => a + b, 0) / (values.length || 1) };
  }).sort((a, b) => b.mean - a.mean).slice(0, 14);
  $("plot-times").innerHTML = timePlot(drawn.times);
  const points = state.rows.map(row => ({ row, x: get(row, choices.x), y: get(row, choices.y), key: shownValue(valueOf(row, choices.group)), good: valueOf(row, "success") === true, title: titleOf(row) })).filter(p => isNumber(p.x) && isNumber(p.y));
  const rho = spearman(points.map(p => p.x), points.map(p => p.y));
  drawn.scatter = points.map(p => ({ trial_id: get(p.row, "trial_id"), [by]: p.key, [choices.x]: p.x, [choices.y]: p.y }));
  $("plot-scatter").innerHTML = scatterPlot(points, keys, [headOf(choices.x), headOf(choices.y)]) +
    `<p class="hint">Spearman's ρ = ${short(rho.value)} (95 % interval ${short(rho.low)} to ${short(rho.high)}, n = ${rho.count}); filled: success</p>`;
}

// Table --------------------------------------------------------------------------------------------------------
function sortRows() {
  const sign = state.descending ? -1 : 1;
  state.rows.sort((a, b) => {
    const x = get(a, state.sort), y = get(b, state.sort);
    if (x === null || y === null) return (x === null) - (y === null);  // what is missing goes last
    return sign * (typeof x === "number" && typeof y === "number" ? x - y : String(x).localeCompare(String(y), "en", { numeric: true }));
  });
}

function drawTable() {
  const columns = DATA.columns.filter(c => state.shown.has(c.name)), head = $("trials").tHead, body = $("trials").tBodies[0];
  head.replaceChildren(element("tr", {}, ...columns.map(column => {
    const mark = column.name === state.sort ? (state.descending ? " ▼" : " ▲") : "";
    const cell = element("th", { className: column.kind === "number" ? "number" : "", scope: "col", tabIndex: 0, title: column.name }, column.head + mark);
    cell.dataset.column = column.name;
    return cell;
  })));
  const rows = state.rows.slice(state.page * PAGE, (state.page + 1) * PAGE);
  body.replaceChildren(...rows.map(row => {
    const line = element("tr", { tabIndex: 0 }, ...columns.map(column => {
      const value = get(row, column.name), kind = column.kind === "number" ? "number" : column.name === "status" ? value : "";
      return element("td", { className: kind, title: String(value ?? "") }, shownValue(value));
    }));
    line.dataset.row = row;
    return line;
  }));
  const pages = Math.ceil(state.rows.length / PAGE), pager = $("pager");
  pager.replaceChildren(pages > 1 ? `page ${state.page + 1} of ${pages} ` : "");
  if (pages > 1) for (const [text, step] of [["back", -1], ["on", 1]]) {
    const button = element("button", { type: "button", disabled: state.page + step < 0 || state.page + step >= pages }, text);
    button.addEventListener("click", () => { state.page += step; drawTable(); });
    pager.append(button, " ");
  }
}

function listenToTable() {
  const act = event => {
    const head = event.target.closest("th"), line = event.target.closest("tbody tr");
    if (head) {
      state.descending = state.sort === head.dataset.column && !state.descending;
      state.sort = head.dataset.column;
      sortRows();
      writeAddress();
      drawTable();
    } else if (line) openTrial(+line.dataset.row);
  };
  $("trials").addEventListener("click", act);
  $("trials").addEventListener("keydown", event => { if (event.key === "Enter") act(event); });
  $("columns").append(...DATA.columns.map(column => {
    const box = element("input", { type: "checkbox", checked: state.shown.has(column.name) });
    box.addEventListener("change", () => { box.checked ? state.shown.add(column.name) : state.shown.delete(column.name); drawTable(); });
    return element("label", { title: column.name }, box, " " + column.head);
  }));
  $("columns-button").addEventListener("click", () => { $("columns").hidden = !$("columns").hidden; });
  $("common").append(...Object.entries(DATA.common).map(([name, value]) => element("tr", {}, element("td", { title: name }, headOf(name)), element("td", {}, shownValue(value)))));
}

// One trial ----------------------------------------------------------------------------------------------------
let viewer = null, shared = null, open = -1;

function releaseViewer() {  // browsers keep few WebGL contexts
  const context = viewer && viewer.gl && viewer.gl.getExtension("WEBGL_lose_context");
  if (context) context.loseContext();
  viewer = null;
}

function titleOf(row) {
  return ["object.name", "hand.name", "index.name", "seed"].map(name => valueOf(row, name)).filter(v => v !== null).join(", ") + ` (${valueOf(row, "trial_id")})`;
}

function openTrial(row) {
  open = row;
  releaseViewer();
  const id = valueOf(row, "trial_id"), body = $("trial-body"), dialog = $("trial"), source = $(`geometry-${row}`);
  $("trial-title").textContent = titleOf(row);
  const view = element("div", { className: "view" }), canvas = element("canvas", { id: "view" });
  body.replaceChildren();
  if (valueOf(row, "reason")) body.append(element("p", { className: "reason" }, String(valueOf(row, "reason"))));
  if (source) view.append(canvas);
  else view.append(element("p", { className: "hint" }, "No geometry is kept of this trial (record=full keeps it)."));
  const values = element("table", {}, ...DATA.columns.filter(c => get(row, c.name) !== null).map(c => element("tr", {}, element("td", { title: c.name }, c.head), element("td", { className: "number" }, shownValue(get(row, c.name))))));
  body.append(view, element("div", { className: "values" }, values));
  const media = Object.hasOwn(DATA.media, row) ? DATA.media[row] : [];
  body.append(element("div", { className: "pictures" }, ...media.map(([kind, name, url]) => element("figure", {},
    kind === "film" ? element("video", { src: url, controls: true, loop: true, muted: true }) : element("a", { href: url, target: "_blank" }, element("img", { src: url, alt: name, loading: "lazy" })),
    element("figcaption", {}, name)))));
  dialog.open || dialog.showModal();
  dialog.scrollTop = 0;
  if (source) drawView(canvas, view, JSON.parse(source.textContent));
}

function drawView(canvas, view, geometry) {
  shared = shared || JSON.parse($("shared").textContent);
  viewer = new Viewer(canvas);
  if (!viewer.gl) { view.append(element("p", { className: "hint" }, "This browser offers no WebGL.")); return; }
  viewer.show(geometry, shared);
  const layers = [...new Set(viewer.bodies.map(body => body.layer))];
  view.append(element("div", { className: "toggles" }, ...layers.map(layer => {
    const box = element("input", { type: "checkbox", checked: true });
    box.addEventListener("change", () => viewer.toggle(layer, box.checked));
    return element("label", {}, box, " " + layer);
  })));
}

function listenToDialog() {
  const step = by => { const at = state.rows.indexOf(open) + by; if (at >= 0 && at < state.rows.length) openTrial(state.rows[at]); };
  $("close").addEventListener("click", () => $("trial").close());
  $("previous").addEventListener("click", () => step(-1));
  $("next").addEventListener("click", () => step(1));
  $("trial").addEventListener("close", releaseViewer);
}

// A study that is running --------------------------------------------------------------------------------------
function followStudy() {
  if (!DATA.running) return;
  $("running").textContent = `${DATA.running}; this page loads itself again`;
  $("running").hidden = false;
  // Not while a trial is looked at or a filter is being typed; the address keeps the filters.
  setInterval(() => { if (!$("trial").open && document.activeElement === document.body) location.reload(); }, DATA.againAfterMs);
}

readAddress();
followStudy();
buildFilters();
buildPlots();
listenToTable();
listenToDialog();
update();
