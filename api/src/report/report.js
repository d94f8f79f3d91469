for (const place of ["map", "over-time"]) {
  const plot = JSON.parse(document.getElementById(`${place}-plot`).textContent);
  Plotly.newPlot(place, plot.data, plot.layout, plot.config);
}
