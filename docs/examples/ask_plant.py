#!/usr/bin/env python3
"""Asks the plant as an MES does, by gRPC: a blade's record, its inspections and their values; then listens to events.

usage: ask_plant.py HOST:PORT SERIAL --identity DIR [--follow-s SECONDS] [--after SEQUENCE]

HOST:PORT is the plant service's; DIR has identity.pem and authority.pem, of users/NAME with the role mes-reader. The stubs are made as
upload_scan.py says (PYTHONPATH=stubs)."""
import argparse
import sys
import time

import grpc
from sixpoint.inspection.v1 import disposition_pb2, inspection_pb2, inspection_pb2_grpc, value_pb2, value_pb2_grpc
from sixpoint.inspection.v1.inspection_pb2 import Verdict
from sixpoint.plant.v1 import event_pb2, event_pb2_grpc, plant_pb2, plant_pb2_grpc, record_pb2, record_pb2_grpc

AGAIN = (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED, grpc.StatusCode.RESOURCE_EXHAUSTED)


def connect(address, identity):
    with open(f"{identity}/identity.pem", "rb") as own, open(f"{identity}/authority.pem", "rb") as authority:
        pair = own.read()  # key and certificate, in one file
        credentials = grpc.ssl_channel_credentials(authority.read(), pair, pair)
    return grpc.secure_channel(address, credentials, [("grpc.keepalive_time_ms", 30_000)])


def pages(method, request, rows):
    """All rows of a list, page by page."""
    while True:
        page = method(request, timeout=60)
        yield from getattr(page, rows)
        if not page.next_page_token:
            return
        request.page_token = page.next_page_token


def with_unit(value, unit):
    return f"{value:.4f} {unit}"


def print_blade(plant, inspection, blade):
    print(f"{blade}, its record:")
    record = record_pb2_grpc.RecordServiceStub(plant)
    for entry in pages(record.GetBladeRecord, record_pb2.GetBladeRecordRequest(name=blade), "entries"):
        print(f"  {entry.record_sequence} {entry.recorded_at.ToJsonString()} {entry.kind} {entry.name} {entry.verdict} {entry.state}".rstrip())
    print("its inspections:")
    inspections = inspection_pb2_grpc.InspectionServiceStub(inspection)
    for one in pages(inspections.ListInspections, inspection_pb2.ListInspectionsRequest(blade=blade), "inspections"):
        decided = [disposition_pb2.DispositionKind.Name(each.kind) for each in one.dispositions]  # in a list the newest alone
        print(f"  {one.name} {Verdict.Name(one.verdict)}, work order {one.work_order or 'none'}, disposition {decided or 'none'}")
    print("its values, of the newest inspection:")
    values = value_pb2_grpc.ValueServiceStub(inspection)
    for one in pages(values.ListValues, value_pb2.ListValuesRequest(blade=blade, only_newest=True), "values"):
        # Not measured is absent, and never 0.
        found = f"{with_unit(one.value, one.unit)} U95 {with_unit(one.expanded_uncertainty, one.unit)}" if one.HasField("value") else "not measured"
        print(f"  {one.characteristic}: {found}, at most {with_unit(one.upper_limit, one.unit)}: {Verdict.Name(one.verdict)}")


def follow(plant, after, seconds):
    """Each event once. Where the number is kept beside what was done, nothing is lost or done twice, whatever crashes."""
    until = time.monotonic() + seconds
    while (left_s := until - time.monotonic()) > 0:
        try:
            request = event_pb2.WatchEventsRequest(after_sequence=after)
            for answer in event_pb2_grpc.EventServiceStub(plant).WatchEvents(request, timeout=left_s):
                for event in answer.events:
                    entry = event.entry
                    print(f"  {entry.record_sequence} {entry.kind} {entry.name} {entry.blade} {entry.verdict} {entry.state}".rstrip(), flush=True)
                after = answer.looked_at_sequence
        except grpc.RpcError as error:
            if error.code() == grpc.StatusCode.DEADLINE_EXCEEDED:
                break
            if error.code() not in AGAIN:
                raise
            time.sleep(1)
    print(f"looked at all up to {after}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("server")
    parser.add_argument("serial")
    parser.add_argument("--identity", required=True)
    parser.add_argument("--follow-s", type=float, default=0)
    parser.add_argument("--after", type=int, default=0)
    arguments = parser.parse_args()
    try:
        with connect(arguments.server, arguments.identity) as plant:
            listed = plant_pb2_grpc.PlantServiceStub(plant).ListEndpoints(plant_pb2.ListEndpointsRequest(), timeout=20)
            address = {one.area: one.address for one in listed.endpoints}["inspection"]
            with connect(address, arguments.identity) as inspection:
                print_blade(plant, inspection, f"blades/{arguments.serial}")
            if arguments.follow_s > 0:
                print(f"events after {arguments.after}, for {arguments.follow_s:g} s:")
                follow(plant, arguments.after, arguments.follow_s)
    except grpc.RpcError as error:
        print(f"{error.code().name}: {error.details()}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
