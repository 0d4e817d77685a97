#!/usr/bin/env python3
"""Speaks the height under the tip, when it is touched and whenever it has changed.

    speak_heights.py PORT [--text] [--every METRES]

PORT is that of `hapterra run FILE --events PORT`. It speaks through `spd-say`, `espeak-ng`,
`espeak` or `say`, whichever there is; with --text, or without any of them, it prints.
"""

import argparse
import json
import shutil
import socket
import subprocess
import time

SPEAKERS = (["spd-say", "--wait"], ["espeak-ng"], ["espeak"], ["say"])


def lines(port):
    """Yields the events of a session from its start; waits for the start."""
    while True:
        try:
            stream = socket.create_connection(("127.0.0.1", port))
            break
        except ConnectionRefusedError:
            time.sleep(0.1)
    with stream, stream.makefile(encoding="utf-8") as text:
        for line in text:
            yield json.loads(line)


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("port", type=int)
    words.add_argument("--text", action="store_true", help="print instead")
    words.add_argument("--every", type=float, default=10.0, metavar="METRES")
    words = words.parse_args()
    found = [speaker for speaker in SPEAKERS if shutil.which(speaker[0])]
    speaker = None if words.text or not found else found[0]
    spoken, process = None, None
    for event in lines(words.port):
        kind = event["event"]
        if kind == "contact" and not event["touching"]:
            spoken = None
        if kind not in ("contact", "place") or not event.get("touching", True):
            continue
        height = event["height_m"]
        if spoken is not None and abs(height - spoken) < words.every:
            continue
        text = f"{height:.0f} metres"
        if speaker is None:
            print(text, flush=True)
        elif process is None or process.poll() is not None:
            process = subprocess.Popen([*speaker, text])
        else:
            # Still speaking: the next event also has the height.
            continue
        spoken = height


main()
