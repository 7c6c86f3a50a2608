// Plots of a report, as drawings (drawing.h).
#pragma once

#include <string>
#include <vector>

#include "report/document.h"
#include "report/report.h"

namespace sixpoint::report {

struct PlotSize {
  double width_mm = 86, height_mm = 58;
};

// Nominal and measured outline of a section. Deviations, and the tolerance's band, are drawn `magnification` times as large as the section,
// along the nominal's normals; gaps stay open. Colours are those of the deviation picture.
struct SectionPlot {
  Drawing drawing;
  double magnification = 1;
};
// magnification 0: a round number that makes the greatest deviation, or the tolerance, a fifteenth of the plot.
SectionPlot PlotSection(const SectionOutlines& outlines, const PlotSize& size, double magnification = 0);

// How far each hole is from where it should be: an arrow a hole, so many times as long, with a circle of its uncertainty about its head and
// one of its limit about the nominal place. In the coordinate plane along which the holes lie farthest from each other.
struct HolePlot {
  Drawing drawing;
  double magnification = 1;
  std::string axes;      // "x to the right, z up"
  bool labelled = true;  // false: of so many holes only those that are not conform have their names
};
HolePlot PlotHoles(const std::vector<Hole>& holes, const PlotSize& size, double magnification = 0);

// The same with what their captions and alternative texts say.
Figure SectionFigure(const Section& section, const PlotSize& size);
Figure HoleFigure(const std::vector<Hole>& holes, const PlotSize& size);

// The views beside each other, in one scale, with the scale of colours in um.
Drawing PlotDeviation(const DeviationPicture& picture, double width_mm, double greatest_height_mm);

// Where a value lies within its limits, with its uncertainty; none without a value or a limit.
std::optional<Drawing> PlotWithinLimits(const Characteristic& characteristic, double width_mm, double height_mm);

// How much of its tolerance a value takes: 1 at a limit, 0 in the middle, or at 0 where the only limit is an upper one. None where that is not
// told.
std::optional<double> ShareOfTolerance(const Characteristic& characteristic);

Tone ToneOf(Verdict verdict);

}  // namespace sixpoint::report
