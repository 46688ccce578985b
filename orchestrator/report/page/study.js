// The page of a study: each metric against what is swept. Part of the script of the page of a run.

function studySection(data) {
  const study = data.study;
  if (!study) return null;
  const {key, at, labels} = study.axis, name = key.split('.').pop();
  const shown = (value) => labels.length ? labels[Math.round(value) - 1] || '' : String(Number(value.toPrecision(4)));
  const wide = !labels.length && at.length > 1 && at[0] > 0 && at[at.length - 1] / at[0] > 50;
  const charts = study.metrics.map((metric) => chart({
    title: metric.name, x: at, axis: shown, logx: wide, points: true, gaps: true, bars: metric.several,
    meaning: `against ${key}${metric.several ? '; mean, 95 % confidence interval (Student’s t)' : ''}`,
    series: metric.series.map((one, i) => ({name: one.name, colour: colour(i), values: one.values})),
  }));
  if (study.over_rounds) charts.push(overRounds(study.over_rounds));
  const left = study.of > study.rows.length ? `; ${study.rows.length} of ${study.of} rows are shown, table.csv has all` : '';
  return element('section', {}, element('h2', {}, `${plural(study.cells, 'cell')}, by ${name}`), element('div', {class: 'charts'}, ...charts),
    element('h2', {}, 'Table'), element('p', {class: 'quiet'}, `mean over the seeds that have the metric, and its 95 % confidence interval${left}`),
    table(study.heads, study.rows, 'The table of the study'));
}

function overRounds({title, of, curves}) {
  const x = [...new Set(curves.flatMap((curve) => curve.rounds))].sort((a, b) => a - b);
  const series = curves.map((curve, i) => {
    const at = new Map(curve.rounds.map((round, j) => [round, curve.bands[j]]));
    return {name: curve.name, colour: colour(i), values: x.map((round) => at.has(round) ? at.get(round) : null)};
  });
  const left = of > curves.length ? `; ${curves.length} of ${of} cells` : '';
  return chart({title: `${title} over the rounds`, meaning: `median, 5 % to 95 % of the seeds${left}`, x, series, bars: true, log: true,
    gaps: true, wide: true, axis: (value) => String(Math.round(value))});
}
