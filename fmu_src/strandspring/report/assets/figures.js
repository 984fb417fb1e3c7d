// Lets records, cycles and lines of figures be chosen, and figures be read and zoomed; without it all are shown.
(() => {
  "use strict";
  const page = JSON.parse(document.getElementById("page-data").textContent);
  const parts = (root, selector) => [...root.querySelectorAll(selector)];
  const unique = (values) => [...new Set(values.filter((value) => value !== undefined))];
  const ways = ["x", "y"];
  const chosen = { record: String(page.first ?? ""), cycle: "" };  // empty: all
  const figures = parts(document, "figure").map((element) => {
    const panels = parts(element, ".panel"), groups = parts(panels[0], ".data > g");
    const records = unique((panels.length > 1 ? panels : groups).map((part) => part.dataset.record));
    return { element, panels, records };
  });

  function show(figure) {
    const { panels, records } = figure, apart = panels.length > 1;
    const record = records.includes(chosen.record) ? chosen.record : apart || records.length === 1 ? records[0] : "";
    for (const panel of panels) panel.hidden = apart && panel.dataset.record !== record;
    const panel = panels.find((own) => !own.hidden);
    const [buttons, every] = [".legend button", ".data > g"].map((own) => parts(panel, own));
    const groups = every.filter((own) => apart || !record || [undefined, record].includes(own.dataset.record));
    const cycles = records.length > 1 && !record ? [] : unique(groups.map((own) => own.dataset.cycle));
    const cycle = cycles.includes(chosen.cycle) ? chosen.cycle : "";
    const shown = groups.filter((own) => (cycle ? own.dataset.cycle === cycle : !own.classList.contains("detail")) &&
      buttons[own.dataset.name]?.getAttribute("aria-pressed") !== "false");
    for (const group of every) group.style.display = shown.includes(group) ? "inline" : "none";
    buttons.forEach((button, k) => { button.hidden = groups.every((own) => own.dataset.name !== String(k)); });
    const all = apart ? [] : [["", `all ${page.noun.toLowerCase()}s`]];
    offer(figure, "record", all, records.map((place) => [place, page.records[place]]), record);
    offer(figure, "cycle", [["", "all cycles"]], cycles.map((own) => [own, own]), cycle);
    // A part is shown as large as there is room.
    const isPart = cycle !== "" || (!apart && records.length > 1 && record !== "");
    if (isPart || panel.isPart) zoom(panel.querySelector(".plot"), isPart ? boxOf(shown) : null);
    panel.isPart = isPart;
  }

  function offer({ element }, name, all, options, value) {
    const select = element.querySelector(`[data-choice=${name}]`);
    select.parentElement.hidden = options.length < 2;
    select.replaceChildren(...(options.length < 2 ? [] : [...all, ...options]).map(([key, label]) => new Option(label, key)));
    select.value = value;
    select.onchange = () => { chosen[name] = select.value; figures.forEach(show); };
  }

  // Of groups, with a margin, in units of the paths: left, top, width, height.
  function boxOf(groups) {
    const boxes = groups.map((group) => group.getBBox()).filter(({ width, height }) => width + height > 0);
    if (!boxes.length) return null;
    const [[left, right], [top, bottom]] = [["x", "width"], ["y", "height"]].map(([from, size]) =>
      [Math.min(...boxes.map((box) => box[from])), Math.max(...boxes.map((box) => box[from] + box[size]))]);
    const [width, height] = [right - left || 1, bottom - top || 1];
    return [left - 0.04 * width, top - 0.04 * height, 1.08 * width, 1.08 * height];
  }

  const viewBox = (plot) => plot.querySelector(".data").getAttribute("viewBox").split(" ").map(Number);
  const decimals = (width, more) => Math.min(Math.max(more - Math.floor(Math.log10(width)), 0), 20);

  // An axis: values at shares of the whole area, from the left or the bottom, and back; which of them are in the view.
  function axisOf(plot, way) {
    const [low, high] = plot.dataset[way].split(" ").map(Number), log = `${way}log` in plot.dataset;
    const k = ways.indexOf(way), view = viewBox(plot), size = plot.whole[k + 2];
    const [from, to] = [view[k] / size, (view[k] + view[k + 2]) / size], ends = k ? [1 - to, 1 - from] : [from, to];
    const at = (share) => (log ? low * (high / low) ** share : low + (high - low) * share);
    const share = (value) => (log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low));
    return { at, share, log, size, ends, values: ends.map(at), unit: plot.dataset[`${way}unit`] };
  }

  function ticks({ values: [low, high], log }) {
    const range = (from, to) => Array.from({ length: Math.max(to - from + 1, 0) }, (_, k) => from + k);
    if (log && high / low > 5) return range(Math.floor(Math.log10(low)), Math.floor(Math.log10(high)))
      .flatMap((power) => (high / low > 600 ? [1] : [1, 2, 5]).map((digit) => Number(`${digit}e${power}`)))
      .filter((value) => value >= low && value <= high);
    const power = 10 ** Math.floor(Math.log10((high - low) / 5));
    const step = [1, 2, 5, 10].find((digit) => 6 * digit * power >= high - low) * power;
    return range(Math.ceil(low / step), Math.floor(high / step)).map((k) => Number((k * step).toFixed(decimals(step, 1))));
  }

  // Show a part of the area between the axes, null for all of it.
  function zoom(plot, box) {
    if (!plot.whole) return;
    plot.querySelector(".data").setAttribute("viewBox", (box ?? plot.whole).join(" "));
    let [lines, ...texts] = plot.start;
    if (box) {
      const axes = ways.map((way) => axisOf(plot, way));
      lines = "";
      texts = axes.map((axis, k) => ticks(axis).map((value) => {
        const share = axis.share(value), place = 100 * (share - axis.ends[0]) / (axis.ends[1] - axis.ends[0]);
        lines += k ? `M0 ${(1 - share) * axis.size}h${axes[0].size}` : `M${share * axis.size} 0v${axes[1].size}`;
        const text = document.createElementNS(plot.namespaceURI, "text");
        text.textContent = String(value).replace("-", "−");
        text.setAttribute("x", k ? "0" : `${place}%`);
        text.setAttribute("y", k ? `${100 - place}%` : "100%");
        return text;
      }));
    }
    plot.querySelector(".grid").setAttribute("d", lines);
    plot.style.setProperty("--left", Math.max(0, ...texts[1].map((text) => text.textContent.length)));
    ways.forEach((way, k) => plot.querySelector(`g.${way}`).replaceChildren(...texts[k]));
    plot.dispatchEvent(new CustomEvent("zoomed", { detail: box && axisOf(plot, "x").values }));
  }

  function listen(plot) {
    const [readout, selection] = [".readout", ".selection"].map((own) => plot.querySelector(own));
    let start = null;
    plot.whole = viewBox(plot);
    plot.start = [plot.querySelector(".grid").getAttribute("d"), ...ways.map((way) => parts(plot, `g.${way} text`))];
    // Where the pointer is, as shares of width and height from the left and the top.
    const place = (event) => {
      const { left, top, width, height } = plot.getBoundingClientRect();
      return [(event.clientX - left) / width, (event.clientY - top) / height].map((at) => Math.min(Math.max(at, 0), 1));
    };
    // What is chosen of both; all where the pointer hardly moved.
    const stretches = (event) => place(event).map((at, k) => {
      const size = Math.abs(at - start[k]);
      return size < 0.04 ? [0, 1] : [Math.min(at, start[k]), size];
    });
    const on = (type, answer) => plot.addEventListener(type, answer);
    const read = (event) => {
      readout.textContent = place(event).map((share, k) => {
        const { at, log, ends: [from, to], values, unit } = axisOf(plot, ways[k]);
        const value = at(from + (to - from) * (k ? 1 - share : share));
        return `${log ? value.toPrecision(3) : value.toFixed(decimals(values[1] - values[0], 2))} ${unit}`;
      }).join(", ").replaceAll("-", "−");
    };
    on("pointermove", (event) => {
      read(event);
      if (start) stretches(event).forEach(([from, size], k) => {
        selection.setAttribute(ways[k], `${100 * from}%`);
        selection.setAttribute(["width", "height"][k], `${100 * size}%`);
      });
    });
    on("pointerleave", () => { readout.textContent = ""; });
    on("pointerdown", (event) => {
      read(event);
      if (event.pointerType !== "mouse" || event.button) return;
      event.preventDefault();
      plot.setPointerCapture(event.pointerId);
      start = place(event);
    });
    on("pointerup", (event) => {
      if (!start) return;
      const [[x, wide], [y, high]] = stretches(event), [left, top, width, height] = viewBox(plot);
      start = null;
      selection.setAttribute("width", "0");
      if (wide * high < 1) zoom(plot, [left + x * width, top + y * height, wide * width, high * height]);
    });
    on("dblclick", () => zoom(plot, null));
  }

  parts(document, ".plot[data-x]").forEach(listen);
  for (const button of parts(document, ".legend button")) button.addEventListener("click", () => {
    button.setAttribute("aria-pressed", String(button.getAttribute("aria-pressed") !== "true"));
    show(figures.find(({ panels }) => panels.includes(button.closest(".panel"))));
  });
  const folds = parts(document, "details");
  for (const fold of folds) fold.addEventListener("toggle", () => figures.forEach(show));
  addEventListener("beforeprint", () => folds.forEach((fold) => { fold.open = true; }));
  figures.forEach(show);
})();
