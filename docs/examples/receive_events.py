#!/usr/bin/env python3
"""Takes the plant's events where they are posted to (a webhook, docs/events.md), and keeps each once. Python's own library alone.

usage: receive_events.py PORT BOOK.jsonl

The secret that `sixpoint webhook add` showed comes from the environment (SIXPOINT_WEBHOOK_SECRET). BOOK.jsonl gets a line an event. It listens on
this computer alone: put what ends TLS before it."""
import base64
import hashlib
import hmac
import http.server
import json
import os
import sys
import time


def is_from_the_plant(secret, headers, body):
    key = base64.b64decode(secret.removeprefix("whsec_"))
    signed = f'{headers["webhook-id"]}.{headers["webhook-timestamp"]}.'.encode() + body
    code = base64.b64encode(hmac.new(key, signed, hashlib.sha256).digest()).decode()
    is_fresh = abs(time.time() - int(headers["webhook-timestamp"])) < 300
    return is_fresh and hmac.compare_digest(f"v1,{code}", headers["webhook-signature"])


def last_sequence(book):
    if not os.path.exists(book):
        return ""
    with open(book, encoding="utf-8") as file:
        return max((json.loads(line)["sequence"] for line in file), default="")


class Receiver(http.server.BaseHTTPRequestHandler):
    def do_POST(self):
        body = self.rfile.read(min(int(self.headers.get("Content-Length", 0)), 4_000_000))
        try:
            is_signed = is_from_the_plant(os.environ["SIXPOINT_WEBHOOK_SECRET"], self.headers, body)
        except (TypeError, ValueError):
            is_signed = False
        if not is_signed:
            self.send_error(403)
            return
        # A batch that comes again, for an answer was lost: what is not past the last number is there already. A test has no number.
        fresh = [event for event in json.loads(body) if event.get("sequence", "") > self.server.last]
        with open(self.server.book, "a", encoding="utf-8") as file:
            for event in fresh:
                file.write(json.dumps(event) + "\n")
            file.flush()
            os.fsync(file.fileno())
        self.server.last = max([self.server.last, *(event["sequence"] for event in fresh)])
        self.send_response(204)  # now, and not before: they are kept
        self.end_headers()


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__.split("\n\n")[1])
    server = http.server.HTTPServer(("127.0.0.1", int(sys.argv[1])), Receiver)
    server.book = sys.argv[2]
    server.last = last_sequence(server.book)
    server.serve_forever()


if __name__ == "__main__":
    main()
