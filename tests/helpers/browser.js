// What is wrong with a page, as lists of words.
[
  // Texts of one figure that lie over each other.
  () => [...document.querySelectorAll("figure")].flatMap((figure) => {
    const texts = [...figure.querySelectorAll("svg text, .legend span, h3, select, figcaption")]
      .filter((text) => text.textContent.trim() && text.checkVisibility({ opacityProperty: true }))
      .map((text) => [text.textContent.trim().slice(0, 40), text.getBoundingClientRect()])
      .filter(([, box]) => box.width > 0 && box.height > 0);
    return texts.flatMap(([text, a], k) => texts.slice(k + 1)
      .filter(([, b]) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1.5
                      && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 2.5)
      .map(([other]) => `${figure.id}: ${text} / ${other}`));
  }),
  // Figures without a single drawn line, dot, bar or area.
  () => [...document.querySelectorAll("figure:not([hidden])")].filter((figure) =>
    ![...figure.querySelectorAll(".plot path[clip-path], .plot [clip-path] > *")].some((shape) => {
      const box = shape.getBoundingClientRect();
      return box.width + box.height > 2;
    })).map((figure) => figure.id),
  // Figures and texts that reach beyond the page.
  () => [...document.querySelectorAll("main *:not(.panel *)")].filter((element) =>
    element.getBoundingClientRect().right > innerWidth + 0.5).map((element) => element.outerHTML.slice(0, 120)),
].flatMap((find) => find())
