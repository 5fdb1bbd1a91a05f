"""Draws the view in the terminal, `flexcrank watch`, as README shows it.

Usage: python tests/interop/terminal_picture.py BINARY recordings/watch.svg
"""

import sys
import time
from html import escape
from itertools import groupby

import pyte

from check import service
from watch import Watcher

COLUMNS, LINES, SECONDS = 100, 30, 6
WIDTH, HEIGHT, SIZE = 8.4, 17, 14
COLOURS = {
    "black": "#484f58", "red": "#ff7b72", "green": "#7ee787", "brown": "#e3b341", "yellow": "#e3b341", "blue": "#79c0ff",
    "magenta": "#d2a8ff", "cyan": "#76e3ea", "white": "#e6edf3", "default": "#c9d1d9", "brightblack": "#8b949e",
}


# Column and row of the dots of a Braille character, by bit.
DOTS = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3)]


def dots(run, line):
    """The dots of Braille characters as a path: few fonts have them."""
    path = ""
    for column, cell in run:
        bits = ord(cell.data) - 0x2800 if "\u2800" <= cell.data <= "\u28ff" else 0
        for x, y in (DOTS[bit] for bit in range(8) if bits >> bit & 1):
            path += f"M{10 + WIDTH * (column + (x + 0.25) / 2):.1f} {11 + HEIGHT * (line + (y + 0.2) / 4):.1f}h2.4v2.4h-2.4z"
    return path


def without_dots(text):
    return "".join(" " if "\u2800" <= letter <= "\u28ff" else letter for letter in text)


def drawn(screen):
    """The screen as SVG: each run of one colour is a text of fixed width."""
    width, height = COLUMNS * WIDTH + 20, LINES * HEIGHT + 20
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" font-family="monospace" font-size="{SIZE}">',
        f'<rect width="{width:g}" height="{height:g}" rx="8" fill="#0d1117"/>',
    ]
    for line in range(LINES):
        cells = [screen.buffer[line][column] for column in range(COLUMNS)]
        for (colour, bold), run in groupby(enumerate(cells), key=lambda cell: (cell[1].fg, cell[1].bold)):
            run = list(run)
            fill = COLOURS.get(colour, f"#{colour}" if len(colour) == 6 else COLOURS["default"])
            if path := dots(run, line):
                parts.append(f'<path fill="{fill}" d="{path}"/>')
            text = without_dots("".join(cell.data for _, cell in run))
            blank = len(text) - len(text.lstrip())
            text = text.strip()
            if text:
                x, y = 10 + WIDTH * (run[0][0] + blank), 10 + HEIGHT * line + SIZE
                weight = ' font-weight="bold"' if bold else ""
                length = f'textLength="{WIDTH * len(text):g}" lengthAdjust="spacingAndGlyphs"'
                parts.append(f'<text x="{x:g}" y="{y:g}" fill="{fill}"{weight} xml:space="preserve" {length}>{escape(text)}</text>')
    return "\n".join([*parts, "</svg>", ""])


def main():
    with service(["run", "--no-record"], "crank") as (_, client):
        client.learn()
        watcher = Watcher("crank", client.endpoint)
        watcher.screen = pyte.Screen(COLUMNS, LINES)
        watcher.stream = pyte.ByteStream(watcher.screen)
        watcher.size(COLUMNS, LINES)
        until = time.monotonic() + SECONDS
        while time.monotonic() < until:
            watcher.read()
        with open(sys.argv[2], "w") as file:
            file.write(drawn(watcher.screen))
        print(watcher.text())
        watcher.process.terminate()
        watcher.process.wait()


main()
