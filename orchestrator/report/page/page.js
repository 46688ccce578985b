'use strict';
// The page of a run: reads what is embedded in it and draws it. Text from a run is only ever set as text.

let runs = JSON.parse(document.getElementById('data').textContent);
const page = document.getElementById('page');
const drawn = [];  // every picture there is: {title, graph}
const dark = matchMedia('(prefers-color-scheme: dark)');

// Distinct for most eyes, and against the ground.
const palette = () => dark.matches
  ? ['#6ea8fe', '#ffb45c', '#63d297', '#ff8fa3', '#c79bff', '#5fd7e0', '#e6d15a', '#f29ad8', '#a3b18a', '#d0a98f']
  : ['#0a58ca', '#b45309', '#15803d', '#be123c', '#7c3aed', '#0e7490', '#857000', '#a21caf', '#4d5d3a', '#7a4b32'];
const colour = (i) => palette()[i % palette().length];
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function element(name, attributes, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) {
    if (key.startsWith('on')) made.addEventListener(key.slice(2), value);
    else if (value !== undefined && value !== false) made.setAttribute(key, value === true ? '' : value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}
function drawing(name, attributes, ...children) {
  const made = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

function number(value) {
  if (value === null || value === undefined) return '–';
  if (typeof value !== 'number') return String(value);
  if (Number.isInteger(value) && Math.abs(value) < 1e15) return value.toLocaleString('en');
  return rounded(value, 6);
}
function rounded(value, digits) {
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e7) ? value.toExponential(digits - 1).replace(/\.?0*e/, 'e') : String(Number(value.toPrecision(digits)));
}
const plural = (count, word) => `${number(count)} ${word}${count === 1 ? '' : 's'}`;
const cell = (value) => element('td', typeof value === 'number' ? {title: String(value)} : {}, number(value));

function table(heads, rows, caption) {
  return element('div', {class: 'scroll', tabindex: '0', role: 'region', 'aria-label': caption},
    element('table', {},
      element('thead', {}, element('tr', {}, ...heads.map((head) => element('th', {scope: 'col'}, head)))),
      element('tbody', {}, ...rows.map((row) => element('tr', {},
        element('th', {scope: 'row'}, String(row[0])), ...row.slice(1).map(cell))))));
}

// --- curves -----------------------------------------------------------------------------------------------------------

// series: [{name, values, colour, dashed, strong}]; values a number or null per x, or [low, middle, high] where `bars`.
function chart(options) {
  const {title, meaning, x, series, log, bars, events, dt, wide} = options;
  const told = element('div', {class: 'told', 'aria-live': 'off'}, '\u00a0');
  const place = element('div', {class: 'plot', role: 'img',
    'aria-label': `Curves ${options.axis ? '' : 'over time'}: ${title}. ${series.length} curves, ${x.length} points each.`});
  const seconds = (value) => `${Number(value.toPrecision(4))} s`;
  const positive = series.some((one) => one.values.some((v) => (bars ? v && v[1] : v) > 0));
  const scale = {log: log && positive};
  const button = log && positive ? element('button', {type: 'button', 'aria-pressed': 'true', onclick: () => {
    scale.log = !scale.log;
    button.setAttribute('aria-pressed', String(scale.log));
    graph.updateOptions({logscale: scale.log, file: rows()});
  }}, 'logarithmic') : null;
  const figure = element('figure', wide ? {class: 'wide'} : {},
    element('figcaption', {}, element('h3', {}, title), element('span', {class: 'quiet'}, meaning || ''), button), place, told, key(series));
  const shown = (value) => scale.log && !(value > 0) ? null : value;
  const rows = () => x.map((time, i) => [time, ...series.map((one) => {
    const value = one.values[i];
    if (!bars) return value === null || value === undefined ? null : shown(value);
    if (value === null || value === undefined) return [null, null, null];
    return Array.isArray(value) ? value.map(shown) : [shown(value), shown(value), shown(value)];
  })]);
  let graph = null;
  const options_ = {
    labels: ['time', ...series.map((_, i) => 's' + i)],
    colors: series.map((one) => one.colour),
    customBars: Boolean(bars), logscale: scale.log, connectSeparatedPoints: Boolean(options.gaps), legend: 'never',
    fillAlpha: 0.18, strokeWidth: 1.4, axisLineColor: css('--quiet'), gridLineColor: css('--line'), xlabel: '', animatedZooms: false,
    series: Object.fromEntries(series.map((one, i) => ['s' + i,
      {strokePattern: one.dashed ? [6, 4] : null, strokeWidth: one.strong ? 2.4 : one.thin ? 0.8 : 1.4, drawPoints: Boolean(options.points) || x.length < 3}])),
    axes: {x: {axisLabelFormatter: options.axis || seconds, logscale: Boolean(options.logx)}, y: {axisLabelWidth: 62,
      axisLabelFormatter: (value) => rounded(value, 4)}},
    highlightSeriesOpts: {strokeWidth: 2.6}, highlightSeriesBackgroundAlpha: 1,
    highlightCallback: (event, at, points, row, name) => {
      const one = series[Number(String(name || 's0').slice(1))], point = points.find((p) => p.name === name);
      const round = dt ? `, round ${Math.round(at / dt)}` : '';
      told.textContent = `${options.axis ? options.axis(at) : `${Number(at.toPrecision(6))} s`}${round}: ${one ? one.name : ''} ${point ? number(point.yval) : ''}`;
    },
    zoomCallback: (from, to) => {
      if (graph.isZoomed('x')) kept.zoom.set(title, [from, to]);
      else kept.zoom.delete(title);
    },
    unhighlightCallback: () => { told.textContent = '\u00a0'; },
    underlayCallback: (canvas, area, self) => {
      canvas.save();
      canvas.strokeStyle = css('--unknown');
      canvas.globalAlpha = 0.55;
      for (const event of events || []) {
        const at = self.toDomXCoord(event.time);
        if (at < area.x || at > area.x + area.w) continue;
        canvas.beginPath();
        canvas.moveTo(at, area.y);
        canvas.lineTo(at, area.y + area.h);
        canvas.stroke();
      }
      canvas.restore();
    },
  };
  later.push(() => {
    if (x.length === 0) {
      told.textContent = 'nothing is recorded yet';
      return;
    }
    graph = new Dygraph(place, rows(), kept.zoom.has(title) ? {...options_, dateWindow: kept.zoom.get(title)} : options_);
    drawn.push({title, graph});
  });
  return figure;
}
let later = [];  // what needs its place on the page first
const kept = {sliders: new Map(), protocol: 0, zoom: new Map()};  // over a new drawing

function key(series) {
  const named = series.filter((one) => one.key !== false);
  if (named.length > 12) return element('p', {class: 'told'}, `${named[0].name} to ${named[named.length - 1].name}: point at a curve to see whose it is`);
  return element('ul', {class: 'key'}, ...named.map((one) => element('li', {},
    element('i', {class: one.dashed ? 'dashed' : '', style: `border-color:${one.colour}`}), one.name)));
}

function curvesOf(run, one, experiment) {
  const bars = Boolean(one.band);
  const series = [];
  if (bars) {
    const {low, mid, high} = one.band;
    series.push({name: 'median, 5 % to 95 % of the agents', colour: css('--quiet'), strong: true,
      values: run.x.map((_, i) => run.y[mid][i] === null ? null : [run.y[low][i], run.y[mid][i], run.y[high][i]])});
  }
  one.curves.forEach((curve, i) => series.push({name: curve.name, colour: colour(i), values: run.y[curve.at], thin: one.curves.length > 20}));
  if (one.truth !== undefined) series.push({name: 'truth', colour: css('--text'), values: run.y[one.truth], dashed: true, strong: true});
  one.lines.forEach((line, i) => series.push({name: `${line.name} ${number(line.value)}`, colour: [css('--text'), css('--bad'), css('--unknown')][i % 3],
    dashed: true, values: run.x.map(() => line.value)}));
  return chart({title: one.title, meaning: one.meaning, x: run.x, series, log: one.log, bars, events: run.events, dt: experiment.dt});
}

function comparison(data) {
  const all = data.comparison;
  if (!all) return null;
  const protocols = [...new Set(all.curves.map((curve) => curve.protocol))];
  const x = [...new Set(all.curves.flatMap((curve) => curve.x))].sort((a, b) => a - b);
  const seen = new Set();
  const series = all.curves.map((curve) => {
    const at = new Map(curve.x.map((time, i) => [time, curve.y[i]]));
    const first = !seen.has(curve.protocol);
    seen.add(curve.protocol);
    const several = all.curves.length > protocols.length;
    return {name: several ? `${curve.protocol}, seed ${curve.seed}` : curve.protocol, key: first, thin: several,
      colour: colour(protocols.indexOf(curve.protocol)), values: x.map((time) => at.has(time) ? at.get(time) : null)};
  });
  const left = all.of > all.curves.length ? `; ${all.curves.length} of ${all.of} runs` : '';
  return chart({title: all.title, meaning: all.meaning + left, x, series, log: true, gaps: true, wide: true, dt: data.experiment.dt,
    events: data.runs.length ? data.runs[0].events : []});
}

// --- the network and the plane ------------------------------------------------------------------------------------------

function slider(label, count, show, start) {
  const told = element('output', {}, '');
  const begin = Math.min(count - 1, kept.sliders.has(label) ? kept.sliders.get(label) : start || 0);
  const input = element('input', {type: 'range', min: '0', max: String(count - 1), value: String(begin), 'aria-label': label,
    oninput: () => {
      kept.sliders.set(label, Number(input.value));
      told.textContent = show(Number(input.value));
    }});
  told.textContent = show(Number(input.value));
  return element('div', {class: 'slider', 'data-slider': label}, input, told);
}

function network(graphs) {
  const size = 420, margin = 26, radius = Math.max(4, Math.min(13, 150 / Math.sqrt(graphs.agents) / 2));
  const at = (agent) => graphs.places[agent - 1].map((place) => margin + place * (size - 2 * margin));
  const arrow = drawing('marker', {id: 'arrow', viewBox: '0 0 8 8', refX: '8', refY: '4', markerWidth: '7', markerHeight: '7', orient: 'auto'},
    drawing('path', {d: 'M0,0 L8,4 L0,8 z', fill: 'var(--quiet)'}));
  const edges = drawing('g', {stroke: 'var(--quiet)', 'stroke-width': '1.2', class: 'edges'});
  const nodes = drawing('g', {});
  for (let agent = 1; agent <= graphs.agents; ++agent) {
    const [x, y] = at(agent);
    nodes.append(drawing('circle', {cx: x, cy: y, r: radius, fill: 'var(--ground)', stroke: 'var(--accent)', 'stroke-width': '1.5'}));
    if (radius > 6.5) {
      const label = drawing('text', {x, y: y + 4, 'text-anchor': 'middle'});
      label.textContent = agent;
      nodes.append(label);
    }
  }
  const show = (i) => {
    const segment = graphs.segments[i];
    const there = new Set(segment.edges.map(([from, to]) => from + ' ' + to));
    edges.replaceChildren();
    for (const [from, to, weight] of segment.edges) {
      const both = there.has(to + ' ' + from);
      if (both && from > to) continue;
      const [x1, y1] = at(from), [x2, y2] = at(to), length = Math.hypot(x2 - x1, y2 - y1) || 1;
      const short = (radius + 1) / length;
      const line = drawing('line', {x1, y1, x2: x2 + (x1 - x2) * short, y2: y2 + (y1 - y2) * short});
      if (!both) line.setAttribute('marker-end', 'url(#arrow)');
      const title = drawing('title', {});
      title.textContent = `${from} ${both ? '–' : '→'} ${to}, weight ${number(weight)}`;
      line.append(title);
      edges.append(line);
    }
    return `rounds ${number(segment.from)} to ${number(segment.to)}: ${segment.facts}`;
  };
  const picture = drawing('svg', {viewBox: `0 0 ${size} ${size}`, role: 'img', 'aria-label': `The network of ${graphs.agents} agents`},
    drawing('defs', {}, arrow), edges, nodes);
  const count = graphs.segments.length;
  const of = graphs.of > count ? `; ${count} of ${number(graphs.of)} graphs are drawn` : '';
  return element('figure', {}, element('figcaption', {}, element('h3', {}, 'the network'),
    element('span', {class: 'quiet'}, (graphs.of === 1 ? 'one graph, all the time' : `${number(graphs.of)} graphs one after the other`) + of)),
    picture, slider('graph', count, show));
}

function plane(run, graphs, experiment) {
  const frames = run.plane.frames, size = 420, margin = 16;
  const points = frames.flatMap((frame) => [...frame.truth, ...(frame.seen || []).flat()]).filter(Boolean);
  if (points.length === 0) return null;
  // Estimates may begin far away: what is drawn is where the agents are, and a little around it.
  const span = (values) => [Math.min(...values), Math.max(...values)];
  const truths = frames.flatMap((frame) => frame.truth).filter(Boolean);
  const [left, right] = span(truths.map((p) => p[0])), [bottom, top] = span(truths.map((p) => p[1]));
  const scale = (size - 2 * margin) / (Math.max(right - left, top - bottom, 1e-9) * 1.2);
  const place = ([x, y]) => [size / 2 + (x - (left + right) / 2) * scale, size / 2 - (y - (bottom + top) / 2) * scale];
  const paths = drawing('g', {fill: 'none', 'stroke-width': '1', opacity: '.55'});
  frames[0].truth.forEach((_, i) => {
    const way = frames.map((frame) => frame.truth[i]).filter(Boolean).map(place).map((p) => p.map((v) => v.toFixed(1)).join(',')).join(' ');
    paths.append(drawing('polyline', {points: way, stroke: colour(i)}));
  });
  const edges = drawing('g', {stroke: 'var(--line)'}), now = drawing('g', {});
  let observer = 0, at = 0;
  const show = (k) => {
    at = k;
    const frame = frames[k];
    now.replaceChildren();
    edges.replaceChildren();
    const round = experiment.dt ? Math.round(frame.time / experiment.dt) : 0;
    const segment = graphs && graphs.segments.find((one) => one.from <= round && round <= one.to);
    for (const [from, to] of segment ? segment.edges : []) {
      const a = frame.truth[from - 1], b = frame.truth[to - 1];
      if (!a || !b) continue;
      const [x1, y1] = place(a), [x2, y2] = place(b);
      edges.append(drawing('line', {x1, y1, x2, y2}));
    }
    frame.truth.forEach((point, i) => {
      if (!point) return;
      const [cx, cy] = place(point);
      now.append(drawing('circle', {cx, cy, r: 5, fill: colour(i)}));
      const label = drawing('text', {x: cx + 7, y: cy - 6});
      label.textContent = i + 1;
      now.append(label);
    });
    const cross = (point, i) => {
      if (!point) return;
      const [x, y] = place(point);
      now.append(drawing('path', {d: `M${x - 5},${y - 5} L${x + 5},${y + 5} M${x - 5},${y + 5} L${x + 5},${y - 5}`, stroke: colour(i), 'stroke-width': '2'}));
    };
    if (frame.seen) (run.plane.everybody ? frame.seen[observer] : frame.seen.map((own) => own[0])).forEach(cross);
    return `${number(frame.time)} s`;
  };
  const parts = [drawing('svg', {viewBox: `0 0 ${size} ${size}`, role: 'img', 'aria-label': 'Where the agents are in the plane'}, edges, paths, now),
    slider('time', frames.length, show, frames.length - 1)];
  const choice = run.plane.everybody ? element('select', {'aria-label': 'Whose estimates are shown', onchange: (event) => {
    observer = Number(event.target.value);
    show(at);
  }}, ...frames[0].truth.map((_, i) => element('option', {value: String(i)}, `as agent ${i + 1} believes`))) : null;
  const what = frames[0].seen ? 'dots: where they are; crosses: where they are believed to be' : run.plane.truth ? 'where they are' : 'their estimates';
  return element('figure', {}, element('figcaption', {}, element('h3', {}, 'the plane'), element('span', {class: 'quiet'}, what), choice), ...parts);
}

function strips(run) {
  if (!run.strips.length) return null;
  const end = run.x.length ? run.x[run.x.length - 1] : 1;
  const share = (time) => `${(100 * time / (end || 1)).toFixed(2)}%`;
  return element('figure', {class: 'wide'}, element('figcaption', {}, element('h3', {}, 'who was there'), element('span', {class: 'quiet'}, 'over time')),
    element('div', {class: 'strip'}, ...run.strips.flatMap((spans, i) => [element('span', {}, `agent ${i + 1}`),
      element('div', {role: 'img', 'aria-label': `agent ${i + 1}: there ${spans.map(([a, b]) => `from ${number(a)} to ${number(b)} s`).join(', ') || 'never'}`},
        ...spans.map(([a, b]) => element('span', {style: `left:${share(a)};width:max(2px,${(100 * (b - a) / (end || 1)).toFixed(2)}%)`})))])));
}

// --- words and tables -----------------------------------------------------------------------------------------------------

const verdicts = {0: 'PASSED', 1: 'NOT MET', 3: 'FAILED', 4: 'TIMED OUT', 130: 'INTERRUPTED', 143: 'INTERRUPTED'};
function verdict(data) {
  const {experiment, summary} = data;
  if (experiment.exit === null || experiment.exit === undefined) return ['NOT ENDED', 'unknown'];
  const exit = Number(experiment.exit);
  if (exit === 0 && !data.criteria.length) return ['DONE', 'good'];
  if (exit === 3 && summary && summary.ending === 'out_of_time') return ['INCOMPLETE', 'bad'];
  return [verdicts[exit] || `EXIT ${exit}`, exit === 0 ? 'good' : 'bad'];
}

// Lines of a comment that only end because they were long go on.
const sentences = (text) => text.replace(/([^\n])\n(?!\n|[A-Z][a-z]+: )/g, '$1 ');

function head(data, level) {
  const {experiment, host} = data, [word, tone] = verdict(data);
  const facts = [experiment.mode, plural(Number(experiment.agents), 'agent'), `at most ${number(Number(experiment.rounds))} rounds of ${number(experiment.dt)} s`,
    `seed ${experiment.seed}`, Number(experiment.runs) > 1 ? `${experiment.runs} runs` : null, experiment.plant ? `plant ${experiment.plant}` : null,
    experiment.rounds_per_second ? `${number(Math.round(experiment.rounds_per_second))} rounds/s` : null, experiment.began].filter(Boolean);
  const marks = {true: ['✓', 'good', 'met'], false: ['✗', 'bad', 'not met'], null: ['?', 'unknown', 'not judged']};
  return [element('div', {class: 'title'}, element(level, {}, experiment.name), element('span', {class: `verdict ${tone}`}, word)),
    element('p', {class: 'facts'}, facts.join(' · ')),
    experiment.description ? element('p', {class: 'question'}, sentences(experiment.description)) : null,
    experiment.error ? element('p', {class: 'bad'}, experiment.error) : null,
    data.summary && data.summary.incomplete ? element('p', {class: 'bad'}, `incomplete: ${data.summary.incomplete}`) : null,
    data.criteria.length ? element('ul', {class: 'criteria'}, ...data.criteria.map((one) => {
      const [mark, shade, says] = marks[String(one.met)];
      return element('li', {}, element('span', {class: shade, role: 'img', 'aria-label': says}, mark), ' ', element('code', {}, one.text), ' ',
        element('span', {class: 'quiet', title: String(one.value)}, one.value === null ? '' : `(${number(one.value)})`));
    })) : null];
}

function metrics(data) {
  if (!data.metrics.length || data.study) return null;
  const protocols = [...new Set(data.comparison ? data.comparison.curves.map((curve) => curve.protocol) : [])];
  const owner = (name) => protocols.length > 1 ? protocols.find((protocol) => name.startsWith(protocol + '.')) : undefined;
  const rows = new Map();
  for (const [name, value] of data.metrics) {
    const protocol = owner(name), metric = protocol ? name.slice(protocol.length + 1) : name;
    if (!rows.has(metric)) rows.set(metric, new Map());
    rows.get(metric).set(protocol || '', value);
  }
  const columns = protocols.length > 1 ? protocols : [''];
  return element('section', {}, element('h2', {}, 'Metrics'), table(['metric', ...columns.map((one) => one || 'value')],
    [...rows].map(([metric, values]) => [metric, ...columns.map((one) => values.has(one) ? values.get(one) : values.get(''))]), 'Metrics'));
}

function rowsOf(list, caption) {
  if (!list || !list.length) return null;
  const keys = Object.keys(list[0]).filter((name) => list.some((row) => row[name] !== null));
  return element('details', {open: list.length <= 12}, element('summary', {}, caption), table(keys.map((name) => name.replaceAll('_', ' ')),
    list.map((row) => keys.map((name) => row[name])), caption));
}

function theory(data) {
  if (!Array.isArray(data.theory) || !data.theory.length) return null;
  const marks = {holds: ['✓', 'good'], fails: ['✗', 'bad'], refused: ['✗', 'bad'], note: ['·', 'quiet'], left_out: ['–', 'unknown']};
  return element('section', {}, element('h2', {}, 'What theory says'), element('ul', {class: 'theory'}, ...data.theory.map((one) => {
    const [mark, tone] = marks[one.verdict] || marks.note;
    return element('li', {}, element('span', {class: tone}, mark), ` ${one.condition}`, element('span', {class: 'quiet'}, `: ${one.evidence}. ${one.consequence}`));
  })));
}

function again(data) {
  const host = data.host || {}, versions = host.versions || {};
  const facts = [['command', (host.command_line || []).join(' ')], ['folder', data.folder], ['seed', String(data.experiment.seed)],
    ['trace', data.experiment.trace_hash], ['Consort', `${versions.consort || data.experiment.program} (${versions.commit || ''}, ${versions.build || ''}, ${versions.compiler || ''})`],
    ['Cyclone DDS', versions.cyclonedds], ['Eigen', versions.eigen], ['host', host.host ? `${host.host}, ${host.cores} cores, ${host.kernel}` : null]];
  return element('section', {}, element('h2', {}, 'To do it again'), element('p', {}, element('code', {}, `consort run ${data.folder}/experiment.yaml`)),
    table(['', ''], facts.filter(([, value]) => value).map(([name, value]) => [name, String(value)]), 'What was run'));
}

function runSection(data) {
  if (!data.runs.length) return null;
  const place = element('div', {});
  const show = (i) => {
    const run = data.runs[i];
    const told = [run.every > 1 ? `every ${number(run.every)}th report is drawn` : null,
      run.thinned ? 'of each stretch of reports the smallest and the largest value are drawn' : null,
      run.undrawn.length ? `not drawn: ${run.undrawn.join(', ')}` : null].filter(Boolean);
    const charts = run.charts.map((one) => curvesOf(run, one, data.experiment));
    const pictures = [run.plane ? plane(run, i === 0 ? data.graphs : null, data.experiment) : null, i === 0 && data.graphs ? network(data.graphs) : null].filter(Boolean);
    const parts = [];
    if (charts.length + pictures.length) parts.push(element('div', {class: 'charts'}, ...(run.plane ? pictures.slice(0, 1) : []), ...charts,
      ...pictures.slice(run.plane ? 1 : 0), strips(run)));
    if (told.length) parts.push(element('p', {class: 'quiet'}, told.join('; ')));
    if (run.events.length) parts.push(element('details', {open: run.events.length <= 12}, element('summary', {}, plural(run.events.length, 'event')),
      table(['time (s)', 'round', 'event', ''], run.events.map((one) => [number(one.time), one.round, one.kind, one.text]), 'Events')));
    const {totals, links, network: carried, agents, processes} = run.messages;
    const tables = [rowsOf(totals, 'messages of all agents'), rowsOf(agents, 'messages of each agent'), rowsOf(links, 'links, those that lost most first'),
      rowsOf(carried, 'what the network did to them'), rowsOf(processes, 'processes (0: the plant); times in s')].filter(Boolean);
    if (tables.length) parts.push(element('div', {class: 'tables'}, ...tables));
    place.replaceChildren(...parts.filter(Boolean));
    flush();
  };
  const chosen = Math.min(kept.protocol, data.runs.length - 1);
  const buttons = data.runs.map((run, i) => element('button', {type: 'button', 'aria-pressed': String(i === chosen), onclick: () => {
    buttons.forEach((button, j) => button.setAttribute('aria-pressed', String(i === j)));
    kept.protocol = i;
    show(i);
  }}, run.protocol));
  later.push(() => show(chosen));
  return element('section', {}, element('h2', {}, data.runs.length > 1 ? 'Each protocol' : `${data.runs[0].protocol}, seed ${data.runs[0].seed}`),
    data.runs.length > 1 ? element('div', {class: 'choice', role: 'group', 'aria-label': 'Protocol'}, ...buttons) : null, place);
}

function flush() {
  while (later.length) later.shift()();
}

function overlay() {
  const curves = runs.flatMap((data) => (data.comparison ? data.comparison.curves : []).map((curve) => ({...curve,
    protocol: `${data.experiment.name} (${data.folder.split('/').pop()}): ${curve.protocol}`})));
  if (!curves.length) return null;
  return comparison({comparison: {title: runs[0].comparison.title, meaning: 'all runs together', of: curves.length, curves}, experiment: runs[0].experiment, runs: []});
}

function render() {
  drawn.length = 0;
  later = [];
  const parts = [];
  if (runs.length > 1) parts.push(element('h1', {}, `${runs.length} runs`), element('div', {class: 'charts'}, overlay()));
  for (const data of runs) {
    const far = comparison(data);
    parts.push(element('article', {}, ...[...head(data, runs.length > 1 ? 'h2' : 'h1'), far ? element('div', {class: 'charts'}, far) : null, studySection(data), runSection(data),
      metrics(data), theory(data), again(data)].filter(Boolean)));
  }
  page.replaceChildren(...parts.filter(Boolean));
  flush();
}

dark.addEventListener('change', render);

// Live: the server says that there is more; what was chosen stays chosen.
if (document.documentElement.dataset.live) {
  new EventSource('events').onmessage = async () => {
    const answer = await fetch('data.json');
    if (!answer.ok) return;
    runs = await answer.json();
    render();
  };
}
render();
