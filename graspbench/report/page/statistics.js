// Small statistics, the same definitions as graspbench.report.statistics.
const Z95 = 1.959963984540054;

function wilson(successes, count) {
  if (!count) return { value: NaN, low: 0, high: 1, count };
  const rate = successes / count, z2 = Z95 * Z95 / count;
  const centre = (rate + z2 / 2) / (1 + z2);
  const half = Z95 / (1 + z2) * Math.sqrt(rate * (1 - rate) / count + z2 / (4 * count));
  return { value: rate, low: successes ? centre - half : 0, high: successes < count ? centre + half : 1, count };
}

function ranks(values) {
  const order = values.map((_, i) => i).sort((a, b) => values[a] - values[b]), rank = new Array(values.length);
  for (let i = 0; i < order.length;) {
    let j = i;
    while (j < order.length && values[order[j]] === values[order[i]]) j++;
    for (let k = i; k < j; k++) rank[order[k]] = (i + j + 1) / 2;
    i = j;
  }
  return rank;
}

function spearman(x, y) {
  const n = x.length, nothing = { value: NaN, low: -1, high: 1, count: n };
  if (n < 4) return nothing;
  const a = ranks(x), b = ranks(y), mean = (n + 1) / 2;
  let ab = 0, aa = 0, bb = 0;
  for (let i = 0; i < n; i++) {
    ab += (a[i] - mean) * (b[i] - mean); aa += (a[i] - mean) ** 2; bb += (b[i] - mean) ** 2;
  }
  if (!aa || !bb) return nothing;
  const value = ab / Math.sqrt(aa * bb), widest = 1 - 12 / (n * (n * n - 1));
  const clipped = Math.max(-widest, Math.min(widest, value));
  const half = Z95 * Math.sqrt((1 + clipped ** 2 / 2) / (n - 3));
  const low = Math.tanh(Math.atanh(clipped) - half), high = Math.tanh(Math.atanh(clipped) + half);
  return { value, low: Math.min(value, low), high: Math.max(value, high), count: n };
}

function quantile(sorted, share) {
  const at = share * (sorted.length - 1), i = Math.floor(at);
  return i + 1 < sorted.length ? sorted[i] + (at - i) * (sorted[i + 1] - sorted[i]) : sorted[i];
}
