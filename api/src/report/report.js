for (const script of document.querySelectorAll('script[type="application/json"]')) {
  const plot = JSON.parse(script.textContent);
  Plotly.newPlot(script.id.replace(/-plot$/, ""), plot.data, plot.layout, plot.config);
}
