"""Reports: one HTML file that shows a run, a sweep or a study, works offline and opens by double click."""
