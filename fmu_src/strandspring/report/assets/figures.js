// Draws the figures of a page by plotly.js, in the colours of the page; lets records and cycles be chosen.
(async () => {
  "use strict";
  if (!("DecompressionStream" in window)) {
    for (const plot of document.querySelectorAll(".plot")) plot.textContent = "This figure needs a browser of 2023 or later.";
    return;
  }

  async function unpacked(id) {
    const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (c) => c.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  }

  const script = document.createElement("script");
  script.textContent = await unpacked("plotly");
  document.head.append(script);
  const page = JSON.parse(await unpacked("figure-data"));
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const touch = matchMedia("(pointer: coarse)").matches;
  const chosen = { record: page.first, cycle: null };  // null: all

  const isNumbers = (value) => value && typeof value === "object" && "bdata" in value;

  function numbers({ dtype, bdata }) {
    const bytes = Uint8Array.from(atob(bdata), (c) => c.charCodeAt(0));
    return dtype === "f4" ? new Float32Array(bytes.buffer) : new Float64Array(bytes.buffer);
  }

  // Numbers are decoded once; colours are filled in anew, since they follow the page.
  function decoded(value) {
    if (isNumbers(value)) return numbers(value);
    if (Array.isArray(value)) return value.map(decoded);
    if (value && typeof value === "object")
      return Object.fromEntries(Object.entries(value).map(([key, own]) => [key, decoded(own)]));
    return value;
  }

  function coloured(value, style) {
    if (typeof value === "string" && value.startsWith("--")) {
      const [name, opacity] = value.split("/");
      const colour = style.getPropertyValue(name).trim();
      return opacity ? colour + Math.round(255 * opacity).toString(16).padStart(2, "0") : colour;
    }
    if (ArrayBuffer.isView(value)) return value;
    if (Array.isArray(value)) return value.map((own) => coloured(own, style));
    if (value && typeof value === "object")
      return Object.fromEntries(Object.entries(value).map(([key, own]) => [key, coloured(own, style)]));
    return value;
  }

  const figures = page.figures.map((figure) => {
    const element = document.getElementById(`figure-${figure.key}`);
    const traces = decoded(figure.traces);
    const records = [...new Set(traces.map((trace) => trace.meta.record).filter((place) => place !== null))];
    return { ...figure, traces, records, element, plot: element.querySelector(".plot"), selects: {}, hidden: new Set() };
  });

  const recordOf = (figure) => {
    if (figure.records.length === 1) return figure.records[0];
    if (figure.records.includes(chosen.record)) return chosen.record;
    return figure.single ? figure.records[0] ?? null : null;
  };

  const isOf = (trace, record) => record === null || trace.meta.record === null || trace.meta.record === record;

  function cyclesOf(figure) {
    const record = recordOf(figure);
    if (record === null) return [];
    const own = figure.traces.filter((trace) => trace.meta.record === record);
    return [...new Set(own.flatMap((trace) => trace.meta.cycles.map(([label]) => label)))];
  }

  function tracesOf(figure, style) {
    const record = recordOf(figure);
    const cycle = cyclesOf(figure).includes(chosen.cycle) ? chosen.cycle : null;
    return figure.traces.map((trace) => {
      const shown = { ...coloured(trace, style), visible: isOf(trace, record) && !figure.hidden.has(trace.name) };
      if (cycle !== null && trace.meta.cycles.length) {
        const [, start, stop] = trace.meta.cycles.find(([label]) => label === cycle) ?? [cycle, 0, 0];
        shown.x = trace.x.subarray(start, stop);
        shown.y = trace.y.subarray(start, stop);
      } else if (cycle !== null && trace.name === "not compared") {
        shown.visible = false;
      } else if (trace.meta.cycles.length && trace.meta.whole < trace.x.length) {
        shown.x = trace.x.subarray(0, trace.meta.whole);
        shown.y = trace.y.subarray(0, trace.meta.whole);
      }
      return shown;
    });
  }

  function layoutOf(figure, style) {
    const axis = {
      automargin: true, gridcolor: "--grid", zerolinecolor: "--line", linecolor: "--muted", tickcolor: "--muted",
      ticks: "outside", ticklen: 4, exponentformat: "power", separatethousands: false, nticks: 7,
    };
    const title = (own) => ({ ...own.title, standoff: 10 });
    const { xaxis, yaxis } = figure.layout;
    const narrow = figure.plot.clientWidth < 420;
    return coloured({
      ...figure.layout,
      // A narrow matrix has its names once, beside its rows.
      xaxis: { ...axis, ...xaxis, title: title(xaxis), showticklabels: !(narrow && xaxis.type === "category") },
      yaxis: { ...axis, ...yaxis, title: title(yaxis) },
      font: { family: "system-ui, -apple-system, 'Segoe UI', Roboto, Arial, sans-serif", size: narrow ? 11 : 12,
              color: "--text" },
      paper_bgcolor: "--paper", plot_bgcolor: "--paper",
      hoverlabel: { bgcolor: "--page", bordercolor: "--line", font: { color: "--text" } },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: "--muted", activecolor: "--text" },
      margin: { l: 56, r: 14, t: 26, b: 44 },
      barmode: "overlay",
      showlegend: false, hovermode: "closest", dragmode: touch ? false : "zoom", uirevision: "kept",
    }, style);
  }

  const config = (figure) => ({
    responsive: true, displaylogo: false,
    // Named one by one: others lead to a web site.
    modeBarButtons: [["toImage"], ["zoom2d", "pan2d"], ["zoomIn2d", "zoomOut2d", "resetScale2d"]],
    toImageButtonOptions: { format: "svg", filename: figure.key },
  });

  function draw(figure) {
    if (!figure.plot.clientWidth) return null;  // in a section that is folded
    const style = getComputedStyle(document.documentElement);
    return Plotly.react(figure.plot, tracesOf(figure, style), layoutOf(figure, style), config(figure));
  }

  // The options are those of the moment; a list with nothing to choose is not shown.
  function offer(figure) {
    const several = figure.records.length > 1;
    const all = several && !figure.single ? [["", `all ${page.noun.toLowerCase()}s`]] : [];
    const records = several ? [...all, ...figure.records.map((place) => [String(place), page.records[place]])] : [];
    const cycles = cyclesOf(figure);
    fill(figure, "record", page.noun, records, String(recordOf(figure) ?? ""));
    fill(figure, "cycle", "Cycle", cycles.length > 1 ? [["", "all cycles"], ...cycles.map((own) => [own, own])] : [],
         cycles.includes(chosen.cycle) ? chosen.cycle : "");
  }

  function fill(figure, name, text, options, value) {
    let select = figure.selects[name];
    if (!select && options.length) {
      const label = document.createElement("label");
      select = document.createElement("select");
      label.append(text, select);
      figure.element.querySelector(".choice").append(label);
      select.addEventListener("change", () => {
        chosen[name] = select.value === "" ? null : name === "record" ? Number(select.value) : select.value;
        redraw((own) => own.records.length > 1 || own.traces.some((trace) => trace.meta.cycles.length));
      });
      figure.selects[name] = select;
    }
    if (!select) return;
    select.parentElement.hidden = !options.length;
    select.parentElement.style.display = options.length ? "" : "none";
    select.replaceChildren(...options.map(([key, label]) => new Option(label, key)));
    select.value = value;
  }

  // A legend of the page's own: it wraps, never lies over the data and can be reached by keyboard.
  function explain(figure) {
    const record = recordOf(figure);
    const names = new Map();
    for (const trace of figure.traces)
      if (trace.name && isOf(trace, record) && !names.has(trace.name)) names.set(trace.name, trace.meta);
    const buttons = [...names].map(([name, { colour, form }]) => {
      const button = document.createElement("button");
      const swatch = document.createElement("span");
      swatch.className = `swatch ${form}`;
      swatch.style.color = `var(--${colour})`;
      button.type = "button";
      button.append(swatch, name);
      button.setAttribute("aria-pressed", String(!figure.hidden.has(name)));
      button.addEventListener("click", () => {
        if (!figure.hidden.delete(name)) figure.hidden.add(name);
        button.setAttribute("aria-pressed", String(!figure.hidden.has(name)));
        draw(figure);
      });
      return button;
    });
    figure.element.querySelector(".legend").replaceChildren(...(buttons.length > 1 ? buttons : []));
  }

  function redraw(which = () => true) {
    for (const figure of figures.filter(which)) {
      offer(figure);
      explain(figure);
      draw(figure);
    }
  }

  // One figure after the other, so that the page answers meanwhile.
  async function start() {
    for (const figure of figures) {
      offer(figure);
      explain(figure);
      await draw(figure);
      await new Promise((resume) => setTimeout(resume));
    }
    const folds = [...document.querySelectorAll("details")];
    for (const fold of folds) fold.addEventListener("toggle", () => redraw((own) => fold.contains(own.element)));
    addEventListener("beforeprint", () => {
      for (const fold of folds) fold.open = true;
      redraw();
    });
    dark.addEventListener("change", () => redraw());
    document.documentElement.dataset.drawn = figures.length;
  }
  start();
})();
