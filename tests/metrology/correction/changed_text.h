// A program with one thing changed.
#pragma once

#include <gtest/gtest.h>

#include <string>

namespace sixpoint::metrology {

inline std::string With(std::string text, const std::string& part, const std::string& instead) {
  const std::size_t at = text.find(part);
  EXPECT_NE(at, std::string::npos) << part << " in\n" << text;
  return at == std::string::npos ? text : text.replace(at, part.size(), instead);
}

}  // namespace sixpoint::metrology
