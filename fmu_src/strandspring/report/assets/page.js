// Lets records be chosen, and figures be read and zoomed; of a record also the options that choose what is zoomed into.
(() => {
  "use strict";
  const page = JSON.parse(document.getElementById("page-data").textContent);
  const parts = (root, selector) => [...root.querySelectorAll(selector)];
  let chosen = String(page.first ?? "");  // place of a record; empty: all

  // A figure has a panel for each record, or one in which lines belong to records.
  const figures = parts(document, "figure").map((figure) => {
    const apart = parts(figure, ".panel[data-record]"), owned = apart.length ? apart : parts(figure, "[data-record]");
    const records = [...new Set(owned.map((part) => part.dataset.record))], select = figure.querySelector("select");
    if (records.length > 1) {
      if (!apart.length) select.add(new Option(`all ${page.noun.toLowerCase()}s`, ""));
      for (const record of records) select.add(new Option(page.records[record], record));
      select.addEventListener("change", () => { chosen = select.value; figures.forEach((show) => show()); });
      select.parentElement.hidden = false;
    }
    return () => {
      const record = records.includes(chosen) ? chosen : apart.length ? records[0] : "";
      select.value = record;
      for (const part of owned) part.toggleAttribute("hidden", record !== "" && part.dataset.record !== record);
    };
  });

  const decimals = (width, more) => Math.min(Math.max(more - Math.floor(Math.log10(width)), 0), 20);

  function listen(plot) {
    const [box, ends, log, units] = JSON.parse(plot.dataset.scales), whole = plot.getAttribute("viewBox");
    const selection = document.createElementNS(plot.namespaceURI, "rect");
    const readout = plot.closest("figure").querySelector(".readout");
    let start = null;
    selection.setAttribute("class", "selection");
    plot.append(selection);
    // Where the pointer is between the axes, and the value of x or y there.
    const place = (event) => {
      const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(plot.getScreenCTM().inverse());
      return [at.x, at.y].map((value, k) => Math.min(Math.max(value, box[2 * k]), box[2 * k + 1]));
    };
    const valueAt = (at, k) => {
      const [low, high] = ends.slice(2 * k), [from, to] = k ? [box[3], box[2]] : box, share = (at - from) / (to - from);
      return log[k] ? low * (high / low) ** share : low + share * (high - low);
    };
    const draw = (sides) => Object.entries(sides).forEach(([name, size]) => selection.setAttribute(name, size));
    const sidesTo = (end) => {
      const [left, top] = [0, 1].map((k) => Math.min(start[k], end[k]));
      return { x: left, y: top, width: Math.abs(end[0] - start[0]), height: Math.abs(end[1] - start[1]) };
    };
    const zoom = (view, range) => {
      plot.setAttribute("viewBox", view);
      plot.classList.toggle("zoomed", view !== whole);
      plot.dispatchEvent(new CustomEvent("zoomed", { detail: range }));
    };
    plot.addEventListener("pointermove", (event) => {
      readout.textContent = place(event).map((at, k) => {
        const value = valueAt(at, k), digits = decimals(Math.abs(ends[2 * k + 1] - ends[2 * k]), 3);
        return `${log[k] ? value.toPrecision(4) : value.toFixed(digits)} ${units[k]}`;
      }).join(", ").replaceAll("-", "−");
      if (start) draw(sidesTo(place(event)));
    });
    plot.addEventListener("pointerleave", () => { readout.textContent = ""; });
    plot.addEventListener("pointerdown", (event) => {
      if (event.pointerType !== "mouse" || event.button) return;
      event.preventDefault();
      plot.setPointerCapture(event.pointerId);
      start = place(event);
    });
    plot.addEventListener("pointerup", (event) => {
      if (!start) return;
      const end = place(event), { x, y, width, height } = sidesTo(end), range = [start[0], end[0]].map((at) => valueAt(at, 0));
      start = null;
      draw({ width: 0, height: 0 });
      // Where the pointer hardly moved up, all that lies above and below is kept.
      if (width > 8) zoom(height > 8 ? [x, y, width, height].join(" ") : [x, box[2], width, box[3] - box[2]].join(" "), range);
    });
    plot.addEventListener("dblclick", () => zoom(whole, null));
  }

  // The options that choose what is zoomed into, and the cycles chosen.
  function choose({ cycles, timed }) {
    const part = (id) => document.getElementById(id), [first, last, options] = ["first-cycle", "last-cycle", "options"].map(part);
    const windows = { "--displacement-range": null, "--time": null };
    const show = () => {
      const [from, to] = [Number(first.value), Number(last.value)], words = [];
      if (cycles > 1 && (from > 1 || to < cycles))
        words.push(from === to ? `--cycles ${from}` : `--cycles ${from > 1 ? from : ""}:${to < cycles ? to : ""}`);
      for (const [option, ends] of Object.entries(windows)) {
        const digits = ends && decimals(Math.abs(ends[1] - ends[0]), 3);
        if (ends) words.push(`${option} ${ends.sort((a, b) => a - b).map((end) => String(Number(end.toFixed(digits)))).join(":")}`);
      }
      options.value = words.join(" ") || "everything is chosen: no option is needed";
    };
    const reset = () => {
      [first.value, last.value] = ["1", String(cycles)];
      for (const plot of parts(document, ".plot")) plot.dispatchEvent(new Event("dblclick"));
      show();
    };
    for (const select of [first, last]) {
      for (let number = 1; number <= cycles; number += 1) select.add(new Option(String(number)));
      select.disabled = cycles < 2;
      select.addEventListener("change", () => {
        if (Number(last.value) < Number(first.value)) [first.value, last.value] = [select.value, select.value];
        show();
      });
    }
    for (const [figure, option] of [["loops", "--displacement-range"], ...(timed ? [["displacement", "--time"], ["force", "--time"]] : [])])
      for (const plot of parts(document, `#figure-${figure} .plot`))
        plot.addEventListener("zoomed", ({ detail }) => { windows[option] = detail; show(); });
    part("reset").addEventListener("click", reset);
    reset();
  }

  parts(document, ".plot[data-scales^='[']").forEach(listen);
  if (page.choice) choose(page.choice);
  addEventListener("beforeprint", () => parts(document, "details").forEach((fold) => { fold.open = true; }));
  figures.forEach((show) => show());
})();
