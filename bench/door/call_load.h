// Calls at a rate that does not wait for their answers, as many independent clients make them: HTTP/2 by nghttp2 and TLS on one
// thread, so that one core asks for more than another can answer.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace sixpoint::bench {

struct CallLoad {
  std::string address;   // 127.0.0.1:PORT
  std::string identity;  // folder of identity.pem and authority.pem
  std::string source;    // the address that makes the peer; empty: the usual one
  std::string path;      // /sixpoint.plant.v1.PlantService/GetMachine
  // What each call sends, taken in turns: messages as gRPC frames them. kPlaceholder in it is another id in each call.
  std::vector<std::string> bodies;
  int connection_count = 8;
  int most_in_flight =
      0;  // of each connection, and the next begins as one ends; 0: `calls_per_s` says when calls begin
  double calls_per_s = 0;
  double seconds = 5;
  int deadline_ms = 2000;
};

inline constexpr char kPlaceholder[] = "00000000-0000-7000-8000-000000000000";

// Calls asked for and answered in time a second, times from being due, what was refused and whether it said when to come again.
nlohmann::json RunCallLoad(const CallLoad& load);

}  // namespace sixpoint::bench
