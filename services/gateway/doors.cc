#include "services/gateway/doors.h"

#include <absl/strings/escaping.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <charconv>
#include <cstdint>

#include "services/gateway/connect_protocol.h"
#include "services/runtime/errors.h"
#include "services/runtime/retry.h"
#include "sixpoint/correction/v1/correction.pb.h"
#include "sixpoint/ingest/v1/ingest.pb.h"

namespace sixpoint::gateway {
namespace {

namespace http = boost::beast::http;
using google::protobuf::util::TimeUtil;

ConnectRefusal WrongMethod(const std::string& allowed) {
  const grpc::Status status(grpc::StatusCode::UNIMPLEMENTED, "method: want " + allowed);
  return {status, 405, allowed};
}

// The query has these names and no others.
absl::Status CheckQuery(const Url& url, const std::vector<std::string>& known) {
  std::string wanted;
  for (const std::string& name : known) wanted += (wanted.empty() ? "" : ", ") + name;
  for (const auto& [name, value] : url.query)
    if (std::find(known.begin(), known.end(), name) == known.end())
      return runtime::Refuse("query", name.substr(0, 80), wanted);
  return absl::OkStatus();
}

// RFC 9110, 14.1.2: bytes=5-9, bytes=5-, bytes=-3; one of them. What is none counts for nothing, as the standard has it.
struct Range {
  std::int64_t first = 0, count = 0;  // count 0: all that follow
  std::int64_t last_bytes = 0;        // not 0: so many at the end
};
std::optional<Range> RangeOf(const std::string& header) {
  constexpr std::string_view kUnit = "bytes=";
  if (header.compare(0, kUnit.size(), kUnit) != 0) return std::nullopt;
  const std::string_view text = std::string_view(header).substr(kUnit.size());
  const std::size_t dash = text.find('-');
  if (dash == std::string_view::npos) return std::nullopt;
  const auto number = [](std::string_view digits) -> std::optional<std::int64_t> {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    const bool is_number = error == std::errc() && end == digits.data() + digits.size() && digits[0] != '-';
    return is_number ? std::optional(value) : std::nullopt;
  };
  const std::string_view before = text.substr(0, dash), after = text.substr(dash + 1);
  const std::optional<std::int64_t> first = number(before), last = number(after);
  if (before.empty() && last && *last > 0) return Range{0, 0, *last};
  if (!first || (!after.empty() && (!last || *last < *first))) return std::nullopt;
  return Range{*first, after.empty() ? 0 : *last - *first + 1, 0};
}

// Asked for by its digest it is the same for ever, for who may see it: what a shared browser kept is forgotten at the sign-out.
HttpResponse BlobResponse(const std::string& etag) {
  HttpResponse response;
  response.headers = {{"Content-Type", "application/octet-stream"},
                      {"Cache-Control", "private, max-age=31536000, immutable"},
                      {"Accept-Ranges", "bytes"},
                      {"ETag", etag}};
  return response;
}

}  // namespace

const google::protobuf::MethodDescriptor& MethodNamed(const std::string& name) {
  return *google::protobuf::DescriptorPool::generated_pool()->FindMethodByName(name);
}

Awaitable<HttpResponse> BlobDoor(Exchange* exchange, const Url& url, Upstream* upstream, const CallWish& wish) {
  static const auto* const kMethod = &MethodNamed("sixpoint.ingest.v1.ScanService.GetScanBlob");
  const Exchange::Head& head = exchange->head();
  if (head.method() != http::verb::get && head.method() != http::verb::head) {
    const ConnectRefusal refusal = WrongMethod("GET, HEAD");
    co_return ErrorResponse(refusal);
  }
  if (const absl::Status known = CheckQuery(url, {"of"}); !known.ok()) co_return ErrorResponse(runtime::ToGrpc(known));
  ingest::v1::GetScanBlobRequest request;
  request.set_name(ValueOf(url, "of"));
  request.set_sha256(url.segments.size() == 2 ? url.segments[1] : "");
  const std::string etag = "\"" + request.sha256() + "\"", if_range = HeaderOf(head, "If-Range");
  const bool is_known = HeaderOf(head, "If-None-Match") == etag;
  std::optional<Range> range = RangeOf(HeaderOf(head, "Range"));
  if (!if_range.empty() && if_range != etag) range.reset();
  if (range && range->last_bytes == 0) {
    request.set_first_byte(range->first);
    request.set_byte_count(range->count);
  }
  if (is_known) request.set_byte_count(1);  // whether he may see it still is asked all the same
  auto [status, blob] = co_await upstream->Call<ingest::v1::ScanBlob>(*kMethod, request, wish, exchange);
  if (!status.ok()) {
    const auto violations = ViolationsOf(runtime::FromGrpc(status));
    const bool is_beyond = range && std::any_of(violations.begin(), violations.end(),
                                                [](const Violation& one) { return one.field == "first_byte"; });
    const ConnectRefusal refusal{status, is_beyond ? 416u : 0u, ""};
    co_return ErrorResponse(refusal);
  }
  HttpResponse response = BlobResponse(etag);
  if (is_known) {
    response.status = 304;
    co_return response;
  }
  response.body = std::move(*blob.mutable_data());
  if (range) {
    const std::int64_t size = blob.size_bytes();
    if (range->last_bytes > 0) {
      range->first = std::max<std::int64_t>(0, size - range->last_bytes);
      response.body.erase(0, static_cast<std::size_t>(range->first));
    }
    const std::int64_t last = range->first + static_cast<std::int64_t>(response.body.size()) - 1;
    response.status = 206;
    response.headers.emplace_back("Content-Range", "bytes " + std::to_string(range->first) + "-" +
                                                       std::to_string(last) + "/" + std::to_string(size));
  }
  co_return response;
}

Awaitable<HttpResponse> ProgramDoor(Exchange* exchange, const Url& url, Upstream* upstream, const CallWish& wish) {
  static const auto* const kMethod = &MethodNamed("sixpoint.correction.v1.CorrectionService.FetchProgram");
  if (exchange->head().method() != http::verb::get) {
    const ConnectRefusal refusal = WrongMethod("GET");
    co_return ErrorResponse(refusal);
  }
  const absl::Status known = CheckQuery(url, {"machine", "blade", "clamping", "request_id"});
  if (!known.ok()) co_return ErrorResponse(runtime::ToGrpc(known));
  correction::v1::FetchProgramRequest request;
  request.set_name("corrections/" + (url.segments.size() == 2 ? url.segments[1] : ""));
  request.set_machine(ValueOf(url, "machine"));
  request.set_blade(ValueOf(url, "blade"));
  request.set_clamping(ValueOf(url, "clamping"));
  request.set_request_id(url.query.count("request_id") > 0 ? ValueOf(url, "request_id") : runtime::NewRequestId());
  auto [status, fetched] =
      co_await upstream->Call<correction::v1::FetchProgramResponse>(*kMethod, request, wish, exchange);
  if (!status.ok()) co_return ErrorResponse(status);
  HttpResponse response;
  const std::string digest = absl::Base64Escape(absl::HexStringToBytes(fetched.program_sha256()));
  response.headers = {{"Content-Type", "text/plain; charset=utf-8"},
                      {"Content-Disposition", "attachment; filename=\"" + request.name().substr(12) + ".nc\""},
                      {"Cache-Control", "no-store"},
                      {"Repr-Digest", "sha-256=:" + digest + ":"},  // RFC 9530
                      {"Sixpoint-Fetch", fetched.name()},
                      {"Sixpoint-Usable-Until", TimeUtil::ToString(fetched.usable_until())},
                      {"Sixpoint-Hole-Count", std::to_string(fetched.hole_count())},
                      {"Sixpoint-Cut-Count", std::to_string(fetched.cut_count())}};
  response.body = std::move(*fetched.mutable_nc_program());
  co_return response;
}

}  // namespace sixpoint::gateway
