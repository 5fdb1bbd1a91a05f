"""MCAP files that another program wrote, with each of its options: sound to `info`, and whole after `recover`."""

import subprocess
import tempfile
from pathlib import Path

from mcap.reader import NonSeekingReader
from mcap.writer import CompressionType, Writer

from check import BINARY, expect

MESSAGES = 50


def written(path, extras, **options):
    with path.open("wb") as file:
        writer = Writer(file, **{"chunk_size": 300, **options})
        writer.start("x", "other")
        schema = writer.register_schema("a.B", "jsonschema", b'{"type": "object"}')
        channels = [writer.register_channel(f"t/{n}", "json", schema) for n in range(3)]
        for n in range(MESSAGES):
            writer.add_message(channels[n % 3], 1000 + 10 * n, b'{"v": %d}' % n, 1000 + 10 * n, n)
        if extras:
            writer.add_attachment(5, 6, "attachment", "text/plain", b"hi")
            writer.add_metadata("metadata", {"key": "value"})
        writer.finish()


def times(path):
    with path.open("rb") as file:
        return [message.log_time for _, _, message in NonSeekingReader(file).iter_messages()]


def main():
    switches = ("repeat_channels", "repeat_schemas", "use_statistics", "use_summary_offsets", "enable_crcs", "enable_data_crcs")
    variants = [{}, *({name: value} for name in switches for value in (False, True)), *({"compression": kind} for kind in CompressionType)]
    with tempfile.TemporaryDirectory() as folder:
        for number, options in enumerate(variants):
            for extras in (False, True):
                path, whole = Path(folder) / f"{number}-{extras}.mcap", Path(folder) / f"{number}-{extras}-whole.mcap"
                written(path, extras, **options)
                what = f"{options or 'usual'}, {'with' if extras else 'without'} attachment and metadata"
                info = subprocess.run([BINARY, "info", path], capture_output=True, text=True)
                expect(f"info: {what}", info.returncode == 0 and f"{MESSAGES} messages" in info.stdout, info.stderr.strip())
                recovered = subprocess.run([BINARY, "recover", path, "-o", whole], capture_output=True, text=True)
                expect(f"recover: {what}", recovered.returncode == 0 and times(whole) == times(path), recovered.stderr.strip())


if __name__ == "__main__":
    main()
