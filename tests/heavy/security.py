"""Who may do what under the configuration that `flexcrank files` prints; every figure that is checked is printed."""

import contextlib
import os
import secrets
import subprocess
import tempfile
import time
from pathlib import Path

import zenoh

from check import BINARY, Client, expect, free_endpoint, wait_for

PASSWORDS = {who: secrets.token_hex(12) for who in ("viewer", "control", "service")}
TIME_OUT_S = 6.0


def certificates(folder):
    """An authority, and a server's certificate signed by it; and another authority that nobody should trust."""
    run = lambda *words: subprocess.run(["openssl", *words], check=True, cwd=folder, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    for name in ("ca", "other-ca"):
        run("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2", "-subj", f"/CN={name}",
            "-keyout", f"{name}-key.pem", "-out", f"{name}.pem", "-addext", "basicConstraints=critical,CA:TRUE")
    run("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-subj", "/CN=gate", "-keyout", "server-key.pem", "-out", "server.csr")
    (folder / "extensions").write_text("subjectAltName=IP:127.0.0.1\nbasicConstraints=CA:FALSE\n")
    run("x509", "-req", "-in", "server.csr", "-CA", "ca.pem", "-CAkey", "ca-key.pem", "-CAcreateserial", "-days", "2", "-extfile", "extensions", "-out", "server.pem")
    (folder / "users.txt").write_text("".join(f"{who}:{password}\n" for who, password in PASSWORDS.items()))


def configure(folder, endpoint):
    """The configuration of the program, with this machine's address and these passwords."""
    printed = lambda name: subprocess.run([BINARY, "files", name], check=True, capture_output=True, text=True).stdout
    gate = printed("gate.json5")
    (folder / "gate.json5").write_text(gate.replace("quic/0.0.0.0:7447", endpoint))
    member = printed("member.json5").replace("quic/gate.example:7447", endpoint)
    assert endpoint in member and endpoint in (folder / "gate.json5").read_text()
    as_user = lambda user, password: member.replace('user: "viewer", password: "the viewer\'s password"', f'user: "{user}", password: "{password}"')
    for who, password in PASSWORDS.items():
        (folder / f"{who}.json5").write_text(as_user(who, password))
    (folder / "wrong-password.json5").write_text(as_user("control", "guessed"))
    (folder / "unknown.json5").write_text(as_user("somebody", PASSWORDS["control"]))
    (folder / "no-password.json5").write_text(member.replace('auth: { usrpwd: { user: "viewer", password: "the viewer\'s password" } },', ""))
    (folder / "other-authority.json5").write_text(as_user("control", PASSWORDS["control"]).replace("ca.pem", "other-ca.pem"))
    (folder / "not-encrypted.json5").write_text(as_user("control", PASSWORDS["control"]).replace("quic/", "tcp/"))


class Deployment:
    """Runs the program in the folder of the configuration, everything logged."""

    def __init__(self, folder, router):
        self.folder, self.router, self.logs = folder, router, ""

    def ask(self, who, *words):
        begun = time.monotonic()
        environment = {**os.environ, "RUST_LOG": "trace"}
        command = [BINARY, words[0], "--zenoh-config", f"{who}.json5", *words[1:]]
        done = subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True, timeout=60)
        self.logs += done.stderr + done.stdout
        errors = [line for line in done.stderr.splitlines() if line.startswith("error:")]
        return done, time.monotonic() - begun, " ".join(errors)

    @contextlib.contextmanager
    def running(self):
        log = self.folder / "service.log"
        own = "service" if self.router else "gate"
        command = [BINARY, "run", "--zenoh-config", f"{own}.json5", "--record", "secure.mcap"]
        with contextlib.ExitStack() as stack:
            if self.router:
                stack.callback(router(self.folder).close)
            output = stack.enter_context(open(log, "w"))
            environment = {**os.environ, "RUST_LOG": "trace"}
            process = subprocess.Popen(command, cwd=self.folder, env=environment, stderr=output)
            try:
                wait_for(lambda: "crank" in self.ask("control", "list")[0].stdout.split(), "the service is up")
                yield
            finally:
                process.terminate()
                process.wait(30)
                self.service_log = log.read_text()
                self.logs += self.service_log


def router(folder):
    before = os.getcwd()
    os.chdir(folder)
    try:
        config = zenoh.Config.from_file("gate.json5")
        config.insert_json5("mode", '"router"')
        return zenoh.open(config)
    finally:
        os.chdir(before)


class Member(Client):
    """A Python client with a configuration file; it subscribes to topics by name, as it must."""

    def __init__(self, folder, who):
        before = os.getcwd()
        os.chdir(folder)
        try:
            self.session = zenoh.open(zenoh.Config.from_file(f"{who}.json5"))
        finally:
            os.chdir(before)
        self.root = "flexcrank/crank"

    def count(self):
        snapshot = self.type("Snapshot").FromString(self.ask("snapshot"))
        return snapshot.status.commands_accepted, snapshot.status.commands_rejected


def roles(folder, deployment):
    done, took_s, _ = deployment.ask("control", "pulse", "crank", "--torque", "3", "--duration", "0.1")
    expect("control may send a pulse", done.returncode == 0, f"{took_s:.2f} s: {done.stdout.strip()}")
    done, *_ = deployment.ask("control", "control", "crank", "pause")
    again, *_ = deployment.ask("control", "control", "crank", "resume")
    expect("control may pause and resume", (done.returncode, again.returncode) == (0, 0))
    for words in (("pulse", "crank", "--torque", "3", "--duration", "0.1"), ("control", "crank", "stop")):
        done, took_s, error = deployment.ask("viewer", *words)
        says = done.returncode == 1 and "no reply" in error and "absent, or not permitted" in error
        expect(f"viewer may not {words[0]}, and is told so", says and took_s < TIME_OUT_S, f"{took_s:.2f} s: {error}")
    for who in ("wrong-password", "unknown", "no-password", "other-authority", "not-encrypted"):
        done, took_s, error = deployment.ask(who, "pulse", "crank", "--torque", "3", "--duration", "0.1")
        expect(f"{who}: nothing is seen", done.returncode == 1 and took_s < TIME_OUT_S, f"{took_s:.2f} s: {error}")
        done, *_ = deployment.ask(who, "list")
        expect(f"{who}: nothing is listed", done.returncode == 1 and not done.stdout.strip())


def wrong_keys(folder):
    """What a client tries that knows its way about, past the program."""
    viewer, spy, control = Member(folder, "viewer"), Member(folder, "viewer"), Member(folder, "control")
    try:
        control.learn()
        viewer.type = control.type
        heard = []
        subscriptions = [spy.session.declare_subscriber(f"flexcrank/crank/{topic}", lambda sample: heard.append(str(sample.key_expr)))
                         for topic in ("angles", "status", "torque", "control")]
        wait_for(lambda: len(heard) > 200, "the viewer reads telemetry")
        expect("viewer reads telemetry", True, f"{len(heard)} messages")
        pulse = control.type("TorquePulse")(torque_nm=1.0, duration_s=0.01).SerializeToString()
        accepted, rejected = control.count()
        keys = ["flexcrank/crank/torque", "flexcrank/*/torque", "flexcrank/**", "**", "flexcrank/crank/*"]
        for key in keys:
            viewer.session.put(key, pulse)
            list(viewer.session.get(key, payload=pulse, timeout=0.3))
        control.session.put("flexcrank/*/torque", pulse)
        # Refusals are logged once a second at most.
        time.sleep(1.2)
        control.session.put("flexcrank/crank/torque", b"\0" * 5000)
        control.session.put("flexcrank/crank/torque", pulse)
        wait_for(lambda: control.count()[0] >= accepted + 1 and control.count()[1] >= rejected + 2, "what is right arrives")
        time.sleep(1.0)
        after = control.count()
        expect("of all that, one pulse is taken, two commands are refused", after == (accepted + 1, rejected + 2),
               f"accepted {after[0] - accepted}, refused {after[1] - rejected}")
        expect("the viewer sees no command on its way", not [key for key in heard if key.endswith(("torque", "control"))])
        del subscriptions
    finally:
        for member in (viewer, spy, control):
            member.session.close()


def trial(router):
    print(f"-- {'through a router' if router else 'without a router'}")
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        certificates(folder)
        configure(folder, free_endpoint().replace("tcp/", "quic/"))
        deployment = Deployment(folder, router)
        with deployment.running():
            roles(folder, deployment)
            wrong_keys(folder)
        refused = [line for line in deployment.service_log.splitlines() if "a command was refused" in line]
        expect("the service logged what it refused", any("itself, not to `flexcrank/*/torque`" in line for line in refused)
               and any("too many for a command" in line for line in refused), f"{len(refused)} lines")
        everything = deployment.logs.encode() + (folder / "secure.mcap").read_bytes()
        told = [who for who, password in PASSWORDS.items() if password.encode() in everything]
        expect("no password in any log at RUST_LOG=trace, nor in the recording", not told, f"{len(deployment.logs) >> 10} KiB of logs {told}")


def main():
    for with_router in (False, True):
        trial(with_router)


if __name__ == "__main__":
    main()
