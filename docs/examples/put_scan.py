#!/usr/bin/env python3
"""Sends a scan to the plant by plain HTTP, as a control does that has no gRPC: header, blocks, end. Python's own library alone.

usage: put_scan.py URL HEADER.json POINTS.f64 [--cafile authority.pem]

URL is the gateway's (http://127.0.0.1:7480). HEADER.json is a ScanHeader of encoding ENCODING_XYZ_F64; POINTS.f64 holds its points, x, y, z
in turn as little-endian doubles, by growing x. The token comes from the environment (SIXPOINT_TOKEN, as `sixpoint certs token` prints it).
Whatever breaks off is gone on with: what the plant has acknowledged is durable and not sent again."""
import argparse
import hashlib
import json
import os
import ssl
import sys
import time
import urllib.error
import urllib.request

BYTES_PER_POINT = 24
POINTS_PER_BLOCK = 50_000  # the plant takes up to 131,072
WAIT_S = [0.5, 1, 2, 4, 8, 8, 8, 8]


class Refused(Exception):
    """The plant's answer is no, whatever is sent again."""


def put(arguments, path, body, content_type):
    """One PUT; its answer as JSON. Raises OSError where it may be sent again."""
    request = urllib.request.Request(arguments.url + path, data=body, method="PUT", headers={
        "Authorization": "Bearer " + os.environ["SIXPOINT_TOKEN"], "Content-Type": content_type})
    context = ssl.create_default_context(cafile=arguments.cafile) if arguments.url.startswith("https:") else None
    try:
        with urllib.request.urlopen(request, timeout=60, context=context) as answer:
            return json.load(answer)
    except urllib.error.HTTPError as error:
        why = json.load(error)
        # Full, restarting, or begun anew elsewhere: the header once more, and on from where it says.
        if why["code"] in ("unavailable", "resource_exhausted", "aborted", "failed_precondition", "canceled"):
            raise OSError(why.get("message")) from error
        raise Refused(f"{why['code']}: {why.get('message')}") from error


def send(arguments, header, blocks):
    scan = header["scanId"]
    progress = put(arguments, f"/scans/{scan}", json.dumps(header).encode(), "application/json")
    for index in range(progress.get("nextBlock", 0), len(blocks)):
        points = len(blocks[index]) // BYTES_PER_POINT
        progress = put(arguments, f"/scans/{scan}/blocks/{index}?points={points}", blocks[index],
                       "application/octet-stream")
        print(f"{progress['nextBlock']} of {len(blocks)} blocks are durable", file=sys.stderr)
    digests = b"".join(hashlib.sha256(block).digest() for block in blocks)
    end = {"blockCount": len(blocks), "pointCount": str(sum(map(len, blocks)) // BYTES_PER_POINT),
           "sha256": hashlib.sha256(digests).hexdigest()}
    return put(arguments, f"/scans/{scan}/end", json.dumps(end).encode(), "application/json")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("url")
    parser.add_argument("header")
    parser.add_argument("points")
    parser.add_argument("--cafile", help="the plant's authority.pem, where the gateway is reached by https")
    arguments = parser.parse_args()
    with open(arguments.header, encoding="utf-8") as file:
        header = json.load(file)
    with open(arguments.points, "rb") as file:
        points = file.read()
    size = BYTES_PER_POINT * POINTS_PER_BLOCK
    blocks = [points[at:at + size] for at in range(0, len(points), size)]
    for wait_s in WAIT_S:
        try:
            stored = send(arguments, header, blocks)
            print(json.dumps({"name": stored["scan"]["name"], "alreadyStored": stored.get("alreadyStored", False)}))
            return 0
        except Refused as refused:
            print(refused, file=sys.stderr)
            return 1
        except OSError as error:
            print(f"{error}; again in {wait_s} s", file=sys.stderr)
            time.sleep(wait_s)
    return 1


if __name__ == "__main__":
    sys.exit(main())
