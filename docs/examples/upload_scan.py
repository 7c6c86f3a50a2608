#!/usr/bin/env python3
"""Sends a scan to the plant by gRPC, as a control does that has Python: header, blocks, end. Stock grpcio and protobuf, stubs by protoc.

usage: upload_scan.py HOST:PORT HEADER.json POINTS.f64 --identity DIR [--stop-after BLOCKS]

HOST:PORT is the plant service's; DIR has identity.pem and authority.pem. HEADER.json is a ScanHeader of encoding ENCODING_XYZ_F64; POINTS.f64
holds its points, x, y, z in turn as little-endian doubles, by growing x. The stubs, once, from the repository's root (and PYTHONPATH=stubs):

    mkdir -p stubs
    protoc -Iproto --python_out=stubs --grpc_python_out=stubs --plugin=protoc-gen-grpc_python=$(command -v grpc_python_plugin) \\
        $(cd proto && find sixpoint google -name '*.proto')

Whatever breaks off is gone on with: what the plant has acknowledged is durable and not sent again."""
import argparse
import hashlib
import queue
import sys
import time

import grpc
from google.protobuf import json_format
from google.rpc import error_details_pb2, status_pb2
from sixpoint.ingest.v1 import ingest_pb2, ingest_pb2_grpc, scan_pb2
from sixpoint.plant.v1 import plant_pb2, plant_pb2_grpc

BYTES_PER_POINT = 24
POINTS_PER_BLOCK = 20_000  # the plant takes up to 131,072
BLOCKS_IN_FLIGHT = 8       # sent and not yet acknowledged
WAIT_S = [0.5, 1, 2, 4, 8, 8, 8, 8]
AGAIN = (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.RESOURCE_EXHAUSTED, grpc.StatusCode.ABORTED, grpc.StatusCode.CANCELLED)


def connect(address, identity):
    with open(f"{identity}/identity.pem", "rb") as own, open(f"{identity}/authority.pem", "rb") as authority:
        pair = own.read()  # key and certificate, in one file
        credentials = grpc.ssl_channel_credentials(authority.read(), pair, pair)
    return grpc.secure_channel(address, credentials, [("grpc.keepalive_time_ms", 30_000)])


def reason_of(error):
    """The reason of docs/errors.md, or the code's name."""
    for key, value in error.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            for detail in status_pb2.Status.FromString(value).details:
                info = error_details_pb2.ErrorInfo()
                if detail.Unpack(info):
                    return info.reason
    return error.code().name


def compare_clocks(trailer):
    ahead_s = time.time() - int(trailer["sixpoint-time-us"]) / 1e6  # when the call began
    if abs(ahead_s) > 5:
        print(f"this clock is {ahead_s:+.0f} s off the plant's", file=sys.stderr)


def send(scans, header, blocks, stop_after):
    """One stream. Gives the stored scan, or None where it was told to stop before."""
    requests = queue.SimpleQueue()
    answers = scans.UploadScan(iter(requests.get, None), timeout=300)
    try:
        requests.put(ingest_pb2.UploadScanRequest(header=header))
        durable = sent = next(answers).accepted.next_block
        print(f"goes on from block {durable} of {len(blocks)}", file=sys.stderr)
        while durable < len(blocks):
            if stop_after is not None and durable >= stop_after:
                answers.cancel()
                return None
            while sent < len(blocks) and sent - durable < BLOCKS_IN_FLIGHT:
                block = scan_pb2.ScanBlock(index=sent, point_count=len(blocks[sent]) // BYTES_PER_POINT, payload=blocks[sent])
                requests.put(ingest_pb2.UploadScanRequest(block=block))
                sent += 1
            durable = next(answers).acknowledged.next_block  # one answer may stand for several
        digests = b"".join(hashlib.sha256(block).digest() for block in blocks)
        requests.put(ingest_pb2.UploadScanRequest(end=scan_pb2.ScanEnd(
            block_count=len(blocks), point_count=sum(map(len, blocks)) // BYTES_PER_POINT,
            sha256=hashlib.sha256(digests).hexdigest())))
        return next(answers).stored
    finally:
        requests.put(None)  # nothing more is sent


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("server")
    parser.add_argument("header")
    parser.add_argument("points")
    parser.add_argument("--identity", required=True)
    parser.add_argument("--stop-after", type=int, metavar="BLOCKS", help="end once so many are durable, as a control that is switched off")
    arguments = parser.parse_args()
    with open(arguments.header, encoding="utf-8") as file:
        header = json_format.Parse(file.read(), scan_pb2.ScanHeader())
    with open(arguments.points, "rb") as file:
        points = file.read()
    size = BYTES_PER_POINT * POINTS_PER_BLOCK
    blocks = [points[at:at + size] for at in range(0, len(points), size)]
    for wait_s in WAIT_S:
        try:
            with connect(arguments.server, arguments.identity) as channel:
                listed, call = plant_pb2_grpc.PlantServiceStub(channel).ListEndpoints.with_call(plant_pb2.ListEndpointsRequest(), timeout=20)
            compare_clocks(dict(call.trailing_metadata()))
            address = {one.area: one.address for one in listed.endpoints}["ingest"]
            with connect(address, arguments.identity) as channel:
                stored = send(ingest_pb2_grpc.ScanServiceStub(channel), header, blocks, arguments.stop_after)
        except grpc.RpcError as error:
            print(f"{error.code().name} {reason_of(error)}: {error.details()}", file=sys.stderr)
            if error.code() not in AGAIN:
                return 1
            time.sleep(wait_s)
            continue
        if stored is None:
            return 0
        scan = stored.scan
        print(f"{scan.name}: {scan.header.point_count} points in {scan.block_count} blocks, {scan.stored_bytes} bytes, kept within "
              f"{scan.proven_error_um:.3f} um, received {scan.received_at.ToJsonString()}{', was there before' if stored.already_stored else ''}")
        return 0
    return 1


if __name__ == "__main__":
    sys.exit(main())
