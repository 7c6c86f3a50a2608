#include "services/runtime/time_proto.h"

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

}  // namespace sixpoint::runtime
