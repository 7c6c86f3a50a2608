// An event as CloudEvents 1.0 have it, in their JSON form: one way for all who hand events on (docs/events.md).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "sixpoint/plant/v1/event.pb.h"

namespace sixpoint::runtime {

// What `datacontenttype`, `dataschema` and `type` say; the schema's last word grows with what is no mere addition.
inline constexpr char kEventSchema[] = "urn:sixpoint:event:1";

// source: of the answer that it came with.
nlohmann::json CloudEventOf(const plant::v1::Event& event, const std::string& source);

}  // namespace sixpoint::runtime
