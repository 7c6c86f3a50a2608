// What there is of the contract beside the Connect protocol, for who has plain HTTP alone: a scan's blobs and a released program by GET.
// Each is one call of a service, which judges the caller as always.
#pragma once

#include "services/gateway/exchange.h"
#include "services/gateway/upstream.h"
#include "services/gateway/url.h"

namespace sixpoint::gateway {

// A method of the contract by its full name, "sixpoint.ingest.v1.ScanService.GetScanBlob", which there is.
const google::protobuf::MethodDescriptor& MethodNamed(const std::string& name);

// GET or HEAD /blobs/{sha256}?of=scans/{scan}: its bytes, or one Range of them. They never change: whoever has them may keep them.
Awaitable<HttpResponse> BlobDoor(Exchange* exchange, const Url& url, Upstream* upstream, const CallWish& wish);

// GET /programs/{correction}?machine=...&blade=...[&clamping=...][&request_id=...]: the NC program as FetchProgram gives it, which records
// the fetch. Without a request_id each request is a fetch of its own.
Awaitable<HttpResponse> ProgramDoor(Exchange* exchange, const Url& url, Upstream* upstream, const CallWish& wish);

}  // namespace sixpoint::gateway
