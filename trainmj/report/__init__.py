"""Reports: one HTML file that shows a run, a sweep or a study, works offline and opens by double click."""

from trainmj.report.folder import write_report, write_run_report

__all__ = ["write_report", "write_run_report"]
