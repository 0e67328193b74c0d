// Plots as SVG text, drawn from the trials that pass the filters.
// After Okabe and Ito: told apart by the colour-blind; neighbours differ in grey too.
const PALETTE = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#d55e00", "#56b4e9", "#7f5539", "#8c8c8c"];
const WIDTH = 480, LEFT = 110, RIGHT = 14, ROW = 26;

function colorOf(key, keys) { return PALETTE[keys.indexOf(key) % PALETTE.length]; }

function escaped(text) {
  return String(text).replace(/[&<>"]/g, c => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" }[c]));
}

function ticks(low, high, wanted) {
  const raw = (high - low) / wanted || 1, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(k => k * power).find(s => s >= raw);
  const found = [];
  for (let t = Math.ceil(low / step) * step; t <= high + 1e-9 * step; t += step) found.push(Math.abs(t) < step / 1e6 ? 0 : t);
  return found;
}

function short(value) {
  if (!Number.isFinite(value)) return "-";
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(1) : String(+value.toPrecision(3));
}

function frame(height, low, high, body) {
  const x = v => LEFT + (v - low) / (high - low || 1) * (WIDTH - LEFT - RIGHT);
  const axis = ticks(low, high, 5).map(t =>
    `<line class="axis" x1="${x(t)}" x2="${x(t)}" y1="4" y2="${height - 20}"/>` +
    `<text x="${x(t)}" y="${height - 6}" text-anchor="middle">${short(t)}</text>`).join("");
  return `<svg viewBox="0 0 ${WIDTH} ${height}" role="img">${axis}${body(x)}</svg>`;
}

function label(text, y) {
  const cut = text.length > 16 ? text.slice(0, 15) + "…" : text;
  return `<text x="${LEFT - 8}" y="${y + 4}" text-anchor="end">${escaped(cut)}<title>${escaped(text)}</title></text>`;
}

/** An SVG that stands alone: on paper, with the styles that the page gives it. */
function standalone(svg) {
  if (!svg) return "";
  const copy = svg.cloneNode(true), [, , width, height] = svg.getAttribute("viewBox").split(" ");
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.setAttribute("width", width);
  copy.setAttribute("height", height);
  const style = document.createElementNS("http://www.w3.org/2000/svg", "style");
  style.textContent = "text{font:11px sans-serif;fill:#333}.axis{stroke:#d9dfe6}.mark{stroke:#1c2733;stroke-width:1.5}";
  copy.prepend(style);
  return new XMLSerializer().serializeToString(copy);
}

/** Every value a dot, quartiles a bar, the median a mark; one row a group. */
function stripPlot(groups) {
  const all = groups.flatMap(g => g.values);
  if (!all.length) return "<p class='hint'>no values</p>";
  const low = Math.min(0, ...all.slice(0, 1), all.reduce((a, b) => Math.min(a, b))), high = all.reduce((a, b) => Math.max(a, b));
  const height = groups.length * ROW + 28, keys = groups.map(g => g.key);
  return frame(height, low, high > low ? high : low + 1, x => groups.map((g, i) => {
    const y = 6 + (i + 0.5) * ROW, sorted = [...g.values].sort((a, b) => a - b), color = colorOf(g.key, keys);
    if (!sorted.length) return label(g.key, y);
    const every = Math.max(1, Math.floor(sorted.length / 300));
    const dots = sorted.filter((_, k) => k % every === 0).map((v, k) =>
      `<circle cx="${x(v).toFixed(1)}" cy="${(y + (k * 37 % 11 - 5)).toFixed(1)}" r="2.2" fill="${color}" opacity=".45"/>`).join("");
    const [a, m, b] = [.25, .5, .75].map(s => x(quantile(sorted, s)));
    return label(g.key, y) + `<rect x="${a}" y="${y - 8}" width="${Math.max(b - a, 1)}" height="16" rx="3" fill="${color}" opacity=".3"/>` +
      dots + `<line class="mark" x1="${m}" x2="${m}" y1="${y - 9}" y2="${y + 9}"><title>median ${short(quantile(sorted, .5))}, n = ${sorted.length}</title></line>`;
  }).join(""));
}

/** Success rates with Wilson's 95 % intervals. */
function ratePlot(groups) {
  const height = groups.length * ROW + 28, keys = groups.map(g => g.key);
  return frame(height, 0, 1, x => groups.map((g, i) => {
    const y = 6 + (i + 0.5) * ROW, w = wilson(g.successes, g.count), color = colorOf(g.key, keys);
    const tip = `<title>${g.successes} of ${g.count}: ${short(100 * w.value)} %, 95 % interval ${short(100 * w.low)} to ${short(100 * w.high)} %</title>`;
    return label(g.key, y) + `<rect x="${x(0)}" y="${y - 7}" width="${x(w.value || 0) - x(0)}" height="14" rx="3" fill="${color}" opacity=".55">${tip}</rect>` +
      `<line class="mark" x1="${x(w.low)}" x2="${x(w.high)}" y1="${y}" y2="${y}">${tip}</line>`;
  }).join(""));
}

/** Mean seconds of each stage. */
function timePlot(stages) {
  if (!stages.length) return "<p class='hint'>no times</p>";
  const high = Math.max(...stages.map(s => s.mean)), height = stages.length * 20 + 28;
  return frame(height, 0, high || 1, x => stages.map((s, i) => {
    const y = 6 + (i + 0.5) * 20;
    return label(s.key, y) + `<rect x="${x(0)}" y="${y - 6}" width="${Math.max(x(s.mean) - x(0), 1)}" height="12" rx="3" fill="${PALETTE[0]}" opacity=".65"><title>${short(s.mean)} s</title></rect>`;
  }).join(""));
}

/** One value against another, coloured by group; a filled dot succeeded, a ring did not. */
function scatterPlot(points, keys, names) {
  if (!points.length) return "<p class='hint'>no trial has both values</p>";
  const height = 340, top = 20, bottom = height - 38, span = axis => {
    const v = points.map(p => p[axis]), low = v.reduce((a, b) => Math.min(a, b)), high = v.reduce((a, b) => Math.max(a, b));
    return high > low ? [low, high] : [low - .5, high + .5];
  };
  const [xl, xh] = span("x"), [yl, yh] = span("y");
  const x = v => 56 + (v - xl) / (xh - xl) * (WIDTH - 72), y = v => bottom - (v - yl) / (yh - yl) * (bottom - top - 8);
  const axes = ticks(xl, xh, 5).map(t => `<line class="axis" x1="${x(t)}" x2="${x(t)}" y1="${top}" y2="${bottom}"/><text x="${x(t)}" y="${bottom + 15}" text-anchor="middle">${short(t)}</text>`).join("") +
    ticks(yl, yh, 5).map(t => `<line class="axis" x1="50" x2="${WIDTH - 8}" y1="${y(t)}" y2="${y(t)}"/><text x="46" y="${y(t) + 4}" text-anchor="end">${short(t)}</text>`).join("");
  const dots = points.map(p => {
    const color = colorOf(p.key, keys);
    return `<circle cx="${x(p.x).toFixed(1)}" cy="${y(p.y).toFixed(1)}" r="3.4" ${p.good ? `fill="${color}" fill-opacity=".65"` : 'fill="none"'} stroke="${color}" data-row="${p.row}"><title>${escaped(p.title)}</title></circle>`;
  }).join("");
  return `<svg viewBox="0 0 ${WIDTH} ${height}" role="img">${axes}${dots}` +
    `<text x="${WIDTH / 2}" y="${height - 6}" text-anchor="middle">${escaped(names[0])}</text>` +
    `<text x="4" y="12">${escaped(names[1])}</text></svg>`;
}
