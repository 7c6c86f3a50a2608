#include "services/runtime/time_proto.h"

#include <cstdint>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

constexpr int kNanosPerMicro = 1000;

}  // namespace

void ToProto(std::chrono::system_clock::time_point moment, google::protobuf::Timestamp* out) {
  const auto micros = std::chrono::floor<std::chrono::microseconds>(moment.time_since_epoch());
  const auto seconds = std::chrono::floor<std::chrono::seconds>(micros);
  out->set_seconds(seconds.count());
  out->set_nanos(static_cast<int>((micros - seconds).count()) * kNanosPerMicro);
}

std::chrono::system_clock::time_point MomentOf(const google::protobuf::Timestamp& time) {
  using Moment = std::chrono::system_clock::time_point;
  return Moment(std::chrono::duration_cast<Moment::duration>(std::chrono::seconds(time.seconds()) +
                                                             std::chrono::microseconds(time.nanos() / kNanosPerMicro)));
}

absl::Status CheckMoment(const std::string& field, const google::protobuf::Timestamp& time) {
  // 2000-01-01 and 2200-01-01.
  constexpr std::int64_t kEarliest_s = 946'684'800, kLatest_s = 7'258'118'400;
  if (time.seconds() < kEarliest_s || time.seconds() >= kLatest_s)
    return Refuse(field + ".seconds", std::to_string(time.seconds()), "a time in the years 2000 to 2199");
  if (time.nanos() < 0 || time.nanos() > 999'999'999)
    return Refuse(field + ".nanos", std::to_string(time.nanos()), "0 to 999999999");
  return absl::OkStatus();
}

absl::Status CheckPast(const std::string& field, const google::protobuf::Timestamp& time) {
  if (absl::Status status = CheckMoment(field, time); !status.ok()) return status;
  google::protobuf::Timestamp now;
  ToProto(std::chrono::system_clock::now(), &now);
  if (MomentOf(time) <= MomentOf(now)) return absl::OkStatus();
  return Refuse(field + ".seconds", std::to_string(time.seconds()),
                "a time that is over: at most " + std::to_string(now.seconds()));
}

}  // namespace sixpoint::runtime
