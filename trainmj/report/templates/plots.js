"use strict";
(() => {
  const PAPER = { width: 660, height: 250 }; // of a plot in print, in pixels: three to a sheet of A4
  const plots = [...document.querySelectorAll(".plot figure")].map((figure) => ({
    canvas: figure.querySelector(".canvas"),
    ...JSON.parse(figure.querySelector("script").textContent),
  }));
  const draw = () => {
    for (const { canvas, data, layout } of plots) {
      const narrow = canvas.clientWidth < 420 ? { font: { ...layout.font, size: 11 } } : {};
      Plotly.newPlot(canvas, data, { ...layout, ...narrow }, {
        responsive: true,
        displaylogo: false,
        modeBarButtonsToRemove: ["lasso2d", "select2d", "autoScale2d"],
      });
    }
    document.documentElement.dataset.plots = "drawn";
  };
  const resize = (paper) => {
    for (const { canvas, layout } of plots) {
      canvas.style.height = `${paper ? PAPER.height : layout.height}px`;
      Plotly.relayout(canvas, paper ? PAPER : { width: null, height: layout.height, autosize: true });
    }
  };
  window.addEventListener("beforeprint", () => resize(true));
  window.addEventListener("afterprint", () => resize(false));
  draw();
})();
