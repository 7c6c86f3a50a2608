// Moments to and from their messages, by microseconds: what a row keeps of them.
#pragma once

#include <google/protobuf/timestamp.pb.h>

#include <chrono>

namespace sixpoint::runtime {

void ToProto(std::chrono::system_clock::time_point moment, google::protobuf::Timestamp* out);
std::chrono::system_clock::time_point MomentOf(const google::protobuf::Timestamp& time);

}  // namespace sixpoint::runtime
