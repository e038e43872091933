"""The questions: command line, demo, report and studies."""
