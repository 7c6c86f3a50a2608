// Moments to and from their messages, by microseconds: what a row keeps of them.
#pragma once

#include <absl/status/status.h>
#include <google/protobuf/timestamp.pb.h>

#include <chrono>
#include <string>

namespace sixpoint::runtime {

void ToProto(std::chrono::system_clock::time_point moment, google::protobuf::Timestamp* out);
std::chrono::system_clock::time_point MomentOf(const google::protobuf::Timestamp& time);
// Of what a client sends: refuses what no clock of a plant says.
absl::Status CheckMoment(const std::string& field, const google::protobuf::Timestamp& time);
// The same, and what lies ahead.
absl::Status CheckPast(const std::string& field, const google::protobuf::Timestamp& time);

}  // namespace sixpoint::runtime
