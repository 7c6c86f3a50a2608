// SHA-256 of bytes that come piece by piece.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

struct evp_md_ctx_st;

namespace sixpoint::ingest {

class RunningDigest {
 public:
  RunningDigest();
  void Add(std::string_view bytes);
  // Lower-case hexadecimal; once, at the end.
  std::string Finish();

 private:
  struct Free {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
};

// SHA-256 over digests given in hexadecimal, 32 bytes each: what a scan is known by.
std::string DigestOfDigests(const std::vector<std::string>& digests);

}  // namespace sixpoint::ingest
