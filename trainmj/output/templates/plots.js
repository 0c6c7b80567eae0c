"use strict";
(() => {
  const PAPER = 660; // width of a plot on a sheet of A4, in pixels
  const onPaper = (height) => Math.round(0.65 * height); // about three to a sheet
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
      const height = paper ? onPaper(layout.height) : layout.height;
      canvas.style.height = `${height}px`;
      Plotly.relayout(canvas, paper ? { width: PAPER, height } : { width: null, height, autosize: true });
    }
  };
  window.addEventListener("beforeprint", () => resize(true));
  window.addEventListener("afterprint", () => resize(false));
  draw();
})();
