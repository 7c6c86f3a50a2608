// Messages as JSON, for programs.
#pragma once

#include <google/protobuf/message.h>

#include <nlohmann/json_fwd.hpp>

namespace sixpoint::cli {

// Every field under its name in the proto files, zeros, empty texts and empty lists too; only what can be unset and is (optional
// values, messages, the others of a oneof) is absent. Integers of any width are numbers, enums their names, bytes base64, times
// RFC 3339; a number that is not finite is null.
nlohmann::json MessageToJson(const google::protobuf::Message& message);

}  // namespace sixpoint::cli
