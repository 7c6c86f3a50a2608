#include "services/runtime/time_proto.h"

#include <gtest/gtest.h>

namespace sixpoint::runtime {
namespace {

using Moment = std::chrono::system_clock::time_point;

// A message's nanoseconds count forward from its seconds, before 1970 too; what is below a microsecond is left out.
TEST(TimeProto, KeepsMicroseconds) {
  for (const std::int64_t micros : {0LL, 1LL, 999'999LL, 1'772'452'800'123'456LL, -1LL, -1'500'000LL}) {
    const Moment moment(std::chrono::microseconds{micros});
    google::protobuf::Timestamp time;
    ToProto(moment, &time);
    EXPECT_GE(time.nanos(), 0) << micros;
    EXPECT_EQ(time.seconds() * 1'000'000 + time.nanos() / 1000, micros);
    EXPECT_EQ(MomentOf(time), moment) << micros;
    time.set_nanos(time.nanos() + 999);
    EXPECT_EQ(MomentOf(time), moment) << micros;
  }
}

}  // namespace
}  // namespace sixpoint::runtime
