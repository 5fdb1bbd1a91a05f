"""A disk that is full: recording ends and says so, the simulation goes on. A limit on the size of files stands for the disk."""

import resource
import signal
import subprocess
import tempfile
from pathlib import Path

from check import BINARY, PATIENCE_S, Client, expect, free_endpoint, wait_for

BYTES = 400_000


def limit():
    # Without the signal, a write beyond the limit fails as on a full disk.
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (BYTES, BYTES))


def main():
    with tempfile.TemporaryDirectory() as folder:
        path, endpoint = Path(folder) / "full.mcap", free_endpoint()
        command = [BINARY, "run", "--name", "full", "--listen", endpoint, "--publish-hz", "all", "--record", str(path)]
        process = subprocess.Popen(
            command, cwd=folder, stderr=subprocess.PIPE, text=True, preexec_fn=limit, restore_signals=False
        )
        client = Client(endpoint, "full")
        try:
            client.learn()
            wait_for(lambda: client.newest("status") and "recording stopped" in client.newest("status").message, "the event comes")
            status = client.newest("status")
            told = not status.HasField("recording") and "File too large" in status.message
            expect("status says that recording stopped, and why", told, status.message)
            end_s = status.stamp.sim_time_s
            wait_for(lambda: client.newest("angles").stamp.sim_time_s > end_s + 2.0, "the simulation goes on")
            status = client.newest("status")
            expect("the simulation goes on, on time", status.state == 1 and status.dropped_samples == 0, f"real-time factor {status.real_time_factor:.4f}")
            start = client.type("Control")(id="again")
            start.start_recording.name = "again"
            expect("a new recording can be asked for", client.command("control", start).accepted)
            process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=PATIENCE_S)
            expect("exit code 3: finished but lossy", process.returncode == 3, said.strip().splitlines()[-1])
        finally:
            client.session.close()
            process.kill()
            process.wait()
        recovered = subprocess.run([BINARY, "recover", str(path), "-o", f"{folder}/whole.mcap"], capture_output=True, text=True)
        kept = path.stat().st_size
        expect("what was written before can be recovered", recovered.returncode in (0, 3) and kept <= BYTES, f"{kept} bytes: {recovered.stdout.strip().splitlines()[:1]}")
    print("full disk: all holds")


if __name__ == "__main__":
    main()
