// Lets records, cycles and lines of figures be chosen, and figures be read and zoomed; without it all are shown.
(() => {
  "use strict";
  const page = JSON.parse(document.getElementById("page-data").textContent);
  const parts = (root, selector) => [...root.querySelectorAll(selector)];
  const unique = (values) => [...new Set(values.filter((value) => value !== undefined))];
  const chosen = { record: String(page.first ?? ""), cycle: "" };  // empty: all
  const figures = parts(document, "figure").map((element) => {
    const panels = parts(element, ".panel"), groups = parts(panels[0], ".data > g");
    const records = unique((panels.length > 1 ? panels : groups).map((part) => part.dataset.record));
    return { panels, records, choice: element.querySelector(".choice"), selects: {} };
  });

  function show(figure) {
    const { panels, records } = figure, apart = panels.length > 1;
    const record = records.includes(chosen.record) ? chosen.record : apart || records.length === 1 ? records[0] : "";
    for (const panel of panels) panel.hidden = apart && panel.dataset.record !== record;
    const panel = panels.find((own) => !own.hidden);
    const groups = parts(panel, ".data > g").filter((own) => {
      own.style.display = "none";
      return apart || !record || [undefined, record].includes(own.dataset.record);
    });
    const cycles = records.length > 1 && !record ? [] : unique(groups.map((own) => own.dataset.cycle));
    const cycle = cycles.includes(chosen.cycle) ? chosen.cycle : "";
    const buttons = parts(panel, ".legend button");
    buttons.forEach((button, name) => { button.hidden = groups.every((own) => own.dataset.name !== String(name)); });
    const shown = groups.filter((own) => (cycle ? own.dataset.cycle === cycle : !own.classList.contains("detail")) &&
      buttons[own.dataset.name]?.getAttribute("aria-pressed") !== "false");
    for (const group of shown) group.style.display = "inline";
    const all = apart ? [] : [["", `all ${page.noun.toLowerCase()}s`]];
    offer(figure, "record", page.noun, all, records.map((place) => [place, page.records[place]]), record);
    offer(figure, "cycle", "Cycle", [["", "all cycles"]], cycles.map((own) => [own, own]), cycle);
    // A part is shown as large as there is room.
    const isPart = cycle !== "" || (!apart && records.length > 1 && record !== "");
    if (isPart || panel.isPart) zoom(panel.querySelector(".plot"), isPart ? boxOf(shown) : null);
    panel.isPart = isPart;
  }

  function offer(figure, name, text, all, options, value) {
    let select = figure.selects[name];
    if (!select && options.length < 2) return;
    if (!select) {
      select = figure.selects[name] = document.createElement("select");
      const label = document.createElement("label");
      label.append(text, select);
      figure.choice.append(label);
      select.addEventListener("change", () => { chosen[name] = select.value; figures.forEach(show); });
    }
    select.parentElement.style.display = options.length > 1 ? "" : "none";
    select.replaceChildren(...[...all, ...options].map(([key, label]) => new Option(label, key)));
    select.value = value;
  }

  // Of groups, with a margin, in units of the paths: left, top, width, height.
  function boxOf(groups) {
    const boxes = groups.map((group) => group.getBBox()).filter(({ width, height }) => width + height > 0);
    if (!boxes.length) return null;
    const [x, y] = ["x", "y"].map((way) => Math.min(...boxes.map((box) => box[way])));
    const width = Math.max(...boxes.map((box) => box.x + box.width)) - x || 1;
    const height = Math.max(...boxes.map((box) => box.y + box.height)) - y || 1;
    return [x - 0.04 * width, y - 0.04 * height, 1.08 * width, 1.08 * height];
  }

  const viewBox = (plot) => plot.querySelector(".data").getAttribute("viewBox").split(" ").map(Number);
  const decimals = (width, more) => Math.min(Math.max(more - Math.floor(Math.log10(width)), 0), 20);

  // An axis of a plot: from shares of the whole area, from the left or the bottom, to values and back; ends of the view.
  function axisOf(plot, way) {
    const [low, high] = plot.dataset[way].split(" ").map(Number), log = `${way}log` in plot.dataset;
    const [x, y, width, height] = viewBox(plot), [wide, high_] = plot.whole.slice(2);
    const at = (share) => (log ? low * (high / low) ** share : low + (high - low) * share);
    const share = (value) => (log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low));
    const view = way === "x" ? [x / wide, (x + width) / wide] : [1 - (y + height) / high_, 1 - y / high_];
    return { at, share, log, view, ends: view.map(at), unit: plot.dataset[`${way}unit`] };
  }

  function ticks({ ends: [low, high], log }) {
    const from = (first, step) => Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, k) => (first + k) * step);
    if (log && high / low > 5) {
      const powers = Array.from({ length: 700 }, (_, k) => k - 350).filter((k) => 10 ** (k + 1) > low && 10 ** k <= high);
      return powers.flatMap((k) => (high / low > 1e3 ? [1] : [1, 2, 5]).map((digit) => Number(`${digit}e${k}`)))
        .filter((value) => value >= low && value <= high);
    }
    const power = 10 ** Math.floor(Math.log10((high - low) / 5));
    const step = [1, 2, 5, 10].find((digit) => digit * power >= (high - low) / 6) * power;
    return from(Math.ceil(low / step - 1e-9), step).map((value) => Number(value.toFixed(decimals(step, 1))));
  }

  // Show a part of the area between the axes, null for all of it.
  function zoom(plot, box) {
    if (!plot.dataset.x) return;
    const data = plot.querySelector(".data"), grid = data.querySelector(".grid");
    const groups = ["x", "y"].map((way) => plot.querySelector(`g.${way}`));
    plot.whole ??= viewBox(plot);
    plot.start ??= [grid.getAttribute("d"), ...groups.map((group) => [...group.childNodes])];
    data.setAttribute("viewBox", (box ?? plot.whole).join(" "));
    let [lines, ...texts] = plot.start;
    if (box) {
      const axes = ["x", "y"].map((way) => axisOf(plot, way)), [, , wide, high] = plot.whole;
      lines = "";
      texts = axes.map((axis, k) => ticks(axis).map((value) => {
        const share = axis.share(value), place = 100 * (share - axis.view[0]) / (axis.view[1] - axis.view[0]);
        lines += k ? `M0 ${(1 - share) * high}h${wide}` : `M${share * wide} 0v${high}`;
        const text = document.createElementNS(plot.namespaceURI, "text");
        text.textContent = String(value).replace("-", "−");
        text.setAttribute("x", k ? "0" : `${place}%`);
        text.setAttribute("y", k ? `${100 - place}%` : "100%");
        return text;
      }));
    }
    grid.setAttribute("d", lines);
    groups.forEach((group, k) => group.replaceChildren(...texts[k]));
    plot.dispatchEvent(new CustomEvent("zoomed", { detail: box && axisOf(plot, "x").ends }));
  }

  for (const plot of parts(document, ".plot[data-x]")) {
    const readout = plot.querySelector(".readout"), selection = document.createElementNS(plot.namespaceURI, "rect");
    selection.setAttribute("class", "selection");
    let start = null;
    const place = (event) => {
      const { left, top, width, height } = plot.getBoundingClientRect();
      return [[event.clientX - left, width], [event.clientY - top, height]].map(([at, size]) => Math.min(Math.max(at, 0), size));
    };
    // The stretch of each direction that is chosen [pixels]; all of it where the pointer hardly moved.
    const stretches = (event) => place(event).map((at, k) => {
      const size = [plot.clientWidth, plot.clientHeight][k];
      return Math.abs(at - start[k]) < 12 ? [0, size] : [Math.min(at, start[k]), Math.abs(at - start[k])];
    });
    const read = (event) => {
      plot.whole ??= viewBox(plot);
      const shares = place(event).map((at, k) => (k ? 1 - at / plot.clientHeight : at / plot.clientWidth));
      readout.textContent = ["x", "y"].map((way, k) => {
        const { at, view: [low, high], ends, log, unit } = axisOf(plot, way), value = at(low + (high - low) * shares[k]);
        const text = log ? value.toPrecision(3) : value.toFixed(decimals(ends[1] - ends[0], 2));
        return `${text.replace("-", "−")} ${unit}`;
      }).join(", ");
    };
    plot.addEventListener("pointermove", (event) => {
      read(event);
      if (start) stretches(event).forEach(([from, size], k) => {
        selection.setAttribute(k ? "y" : "x", from);
        selection.setAttribute(k ? "height" : "width", size);
      });
    });
    plot.addEventListener("pointerleave", () => { readout.textContent = ""; });
    plot.addEventListener("pointerdown", (event) => {
      read(event);
      if (event.pointerType !== "mouse" || event.button) return;
      event.preventDefault();
      plot.setPointerCapture(event.pointerId);
      start = place(event);
      plot.append(selection);
    });
    plot.addEventListener("pointerup", (event) => {
      if (!start) return;
      const [[left, wide], [top, high]] = stretches(event), [x, y, width, height] = viewBox(plot);
      start = null;
      selection.remove();
      const [across, up] = [width / plot.clientWidth, height / plot.clientHeight];
      if (wide < plot.clientWidth || high < plot.clientHeight) zoom(plot, [x + left * across, y + top * up, wide * across, high * up]);
    });
    plot.addEventListener("dblclick", () => zoom(plot, null));
  }

  for (const button of parts(document, ".legend button")) button.addEventListener("click", () => {
    button.setAttribute("aria-pressed", String(button.getAttribute("aria-pressed") !== "true"));
    show(figures.find(({ panels }) => panels.includes(button.closest(".panel"))));
  });
  const folds = parts(document, "details");
  for (const fold of folds) fold.addEventListener("toggle", () => figures.forEach(show));
  addEventListener("beforeprint", () => folds.forEach((fold) => { fold.open = true; }));
  figures.forEach(show);
})();
