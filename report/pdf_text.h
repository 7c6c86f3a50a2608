// What of a text a font can show, and in which order it stands on paper.
#pragma once

#include <string>
#include <vector>

namespace sixpoint::report {

// Code points, those that the font lacks as "[U+4E2D]".
std::vector<char32_t> Shown(const std::string& text, const std::vector<bool>& has);

// Runs of letters that are written from the right are turned round: libharu sets every text from the left. Digits and what else is written
// from the left stay as they are. (No full bidirectional order, and Arabic letters are not joined: names can be read and told apart.)
std::vector<char32_t> InOrderOfSight(std::vector<char32_t> codes);

}  // namespace sixpoint::report
