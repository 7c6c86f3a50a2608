// What a server makes of a certificate that somebody shows: whether the plant's authority gave it, whether it holds now, whether it
// was taken back since. Asked at every call, for a connection outlives a certificate.
#pragma once

#include <absl/status/status.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "identity/identity.h"

namespace sixpoint::identity {

enum class Standing {
  kGood,
  kUnreadable,   // no certificate, or one that names nobody
  kNotOurs,      // another authority's
  kNotYetValid,  // by this computer's clock
  kExpired,
  kRevoked,
  kUndecidable,  // authority or revocation list cannot be read or is not the authority's own: nobody is believed then
};

struct Judgement {
  Standing standing = Standing::kUnreadable;
  Identity identity;    // of kGood, kNotYetValid, kExpired and kRevoked
  std::string serial;   // of the same
  std::string why_not;  // one plain sentence, what is wanted in it; empty of kGood
};

// Thread-safe. Looks at both files at every call and reads them again where they changed, so that what was revoked counts for the
// next call. A list older than one that it read before is none; a process that starts anew cannot know.
class Trust {
 public:
  // `now`: this computer's clock; a test has its own.
  Trust(std::filesystem::path authority_file, std::filesystem::path revoked_file,
        std::function<std::chrono::system_clock::time_point()> now = std::chrono::system_clock::now);
  ~Trust();

  // Not OK where the files cannot be read as what they should be: said at a server's start.
  absl::Status CheckFiles();
  Judgement Judge(std::string_view certificate_pem);

 private:
  struct State;
  const std::unique_ptr<State> state_;
};

}  // namespace sixpoint::identity
