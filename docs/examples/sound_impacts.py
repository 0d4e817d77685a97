#!/usr/bin/env python3
"""Sounds each touch: louder for a faster tip, deeper on water.

    sound_impacts.py PORT [--text]

PORT is that of `hapterra run FILE --events PORT`. It plays through `paplay`, `aplay` or
`afplay`, whichever there is; with --text, or without any of them, it prints.
"""

import argparse
import json
import math
import os
import shutil
import socket
import struct
import subprocess
import tempfile
import time
import wave

PLAYERS = ("paplay", "aplay", "afplay")
RATE_HZ = 44_100
# The speed of the loudest sound, mm/s.
LOUDEST_MM_S = 300.0


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


def write_knock(path, loudness, pitch_hz):
    """Writes a knock of 0.15 s: a tone that dies away."""
    tone = (
        loudness * math.exp(-t / 0.03) * math.sin(2 * math.pi * pitch_hz * t)
        for t in (n / RATE_HZ for n in range(RATE_HZ * 3 // 20))
    )
    with wave.open(path, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE_HZ)
        file.writeframes(b"".join(struct.pack("<h", int(32_767 * x)) for x in tone))


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("port", type=int)
    words.add_argument("--text", action="store_true", help="print instead")
    words = words.parse_args()
    found = [player for player in PLAYERS if shutil.which(player)]
    player = None if words.text or not found else found[0]
    material = None
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "knock.wav")
        for event in lines(words.port):
            if event["event"] == "material":
                material = event["name"]
            if event["event"] != "contact" or not event["speed_mm_s"]:
                continue
            speed = max(event["speed_mm_s"], 0.0)
            loudness = min(speed / LOUDEST_MM_S, 1.0)
            pitch_hz = 160 if material and "water" in material else 400
            if player is None:
                print(f"knock at {speed:.0f} mm/s, loudness {loudness:.2f}, {pitch_hz} Hz", flush=True)
            else:
                write_knock(path, loudness, pitch_hz)
                subprocess.run([player, path], check=False)


main()
