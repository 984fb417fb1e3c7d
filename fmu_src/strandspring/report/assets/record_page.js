// The options that choose what is zoomed into, and the cycles chosen.
(() => {
  "use strict";
  const { cycles, timed } = JSON.parse(document.getElementById("page-data").textContent).choice;
  const part = (id) => document.getElementById(id);
  const [first, last, options] = [part("first-cycle"), part("last-cycle"), part("options")];
  const windows = { "--displacement-range": null, "--time": null };

  // As many digits as show on the axis.
  const rounded = (value, width) => String(Number(value.toFixed(Math.max(0, 3 - Math.floor(Math.log10(width))))));

  function fill(select, chosen) {
    for (let number = 1; number <= cycles; number += 1) select.add(new Option(String(number), String(number)));
    select.value = String(chosen);
    select.disabled = cycles < 2;
  }

  function show() {
    const [from, to] = [Number(first.value), Number(last.value)];
    const words = [];
    if (cycles > 1 && (from > 1 || to < cycles))
      words.push(from === to ? `--cycles ${from}` : `--cycles ${from > 1 ? from : ""}:${to < cycles ? to : ""}`);
    for (const [option, ends] of Object.entries(windows)) {
      if (ends === null) continue;
      const width = Math.abs(ends[1] - ends[0]);
      words.push(`${option} ${rounded(Math.min(...ends), width)}:${rounded(Math.max(...ends), width)}`);
    }
    options.value = words.join(" ") || "everything is chosen: no option is needed";
    part("copy").disabled = !words.length;
  }

  function follow(key, option) {
    for (const plot of document.querySelectorAll(`#figure-${key} .plot`))
      plot.addEventListener("zoomed", ({ detail }) => { windows[option] = detail; show(); });
  }

  fill(first, 1);
  fill(last, cycles);
  first.addEventListener("change", () => { if (Number(last.value) < Number(first.value)) last.value = first.value; show(); });
  last.addEventListener("change", () => { if (Number(last.value) < Number(first.value)) first.value = last.value; show(); });
  part("reset").addEventListener("click", () => {
    first.value = "1";
    last.value = String(cycles);
    for (const plot of document.querySelectorAll(".plot")) plot.dispatchEvent(new Event("dblclick"));
    show();
  });
  part("copy").addEventListener("click", () => navigator.clipboard?.writeText(options.value));
  follow("loops", "--displacement-range");
  if (timed) for (const key of ["displacement", "force"]) follow(key, "--time");
  show();
})();
