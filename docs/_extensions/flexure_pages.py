"""Three directives.

- `program-help COMMAND`: what `flexure COMMAND --help` prints, from the program that FLEXURE_BINARY names.
- `plot NAME`: the picture docs/examples/output/NAME.svg, written into the page, so that it has the page's colours; the content is its caption.
- `recorded NAME`: the output docs/examples/output/NAME.txt, or nothing where it was not recorded.
"""

import os
import subprocess
from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.util.docutils import SphinxDirective

OUTPUT = Path(__file__).resolve().parent.parent / "examples/output"


def program():
    root = Path(__file__).resolve().parent.parent.parent
    return Path(os.environ.get("FLEXURE_BINARY") or root / "target/release/flexure").resolve()


class ProgramHelp(SphinxDirective):
    optional_arguments = 1

    def run(self):
        command = [str(program()), *self.arguments, "--help"]
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "COLUMNS": "86"})
        if done.returncode:
            raise self.error(f"{' '.join(command)}: {done.stderr}")
        block = nodes.literal_block(done.stdout, done.stdout, language="text")
        return [block]


class Plot(SphinxDirective):
    required_arguments = 1
    option_spec = {"alt": directives.unchanged_required}
    has_content = True

    def run(self):
        file = OUTPUT / f"{self.arguments[0]}.svg"
        self.env.note_dependency(str(file))
        if not file.exists():
            raise self.error(f"no picture {file}; docs/examples/run makes it")
        alt = self.options["alt"].replace("&", "&amp;").replace('"', "&quot;")
        svg = file.read_text().replace("<svg", f'<svg role="img" aria-label="{alt}"', 1)
        figure = nodes.figure("", nodes.raw("", svg, format="html"), classes=["plot"])
        if self.content:
            parsed = self.parse_content_to_nodes()
            figure += nodes.caption("", "", *parsed[0].children)
        return [figure]


class Recorded(SphinxDirective):
    required_arguments = 1

    def run(self):
        file = OUTPUT / f"{self.arguments[0]}.txt"
        self.env.note_dependency(str(file))
        if not file.exists():
            return []
        text = file.read_text()
        return [nodes.paragraph("", "It prints:"), nodes.literal_block(text, text, language="text")]


def setup(app):
    app.add_directive("program-help", ProgramHelp)
    app.add_directive("plot", Plot)
    app.add_directive("recorded", Recorded)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
