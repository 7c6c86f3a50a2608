// What this process counts and measures of itself, for Prometheus: one registry a process, names by its conventions (base units, _total
// of what only grows). A label's values are known beforehand, or bounded in number here: who calls a server makes no series.
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace prometheus {
class Counter;
class Gauge;
class Histogram;
}  // namespace prometheus

namespace sixpoint::runtime {

using MetricLabels = std::map<std::string, std::string>;

// All of these are thread-safe, cost an atomic or two, and stay in the registry for ever: who makes one of the same name and labels
// again gets the same one.
class Counter {
 public:
  Counter(const std::string& name, const std::string& help, const MetricLabels& labels = {});
  void Add(double by = 1);

 private:
  prometheus::Counter* const counter_;
};

class Gauge {
 public:
  Gauge(const std::string& name, const std::string& help, const MetricLabels& labels = {});
  void Set(double value);
  void Add(double by);

 private:
  prometheus::Gauge* const gauge_;
};

class Histogram {
 public:
  // limits: of its buckets, ascending.
  Histogram(const std::string& name, const std::string& help, const std::vector<double>& limits,
            const MetricLabels& labels = {});
  void Observe(double value);

 private:
  prometheus::Histogram* const histogram_;
};

// One counter for each value of a label; what is none of them is counted as "other".
class CounterBy {
 public:
  // values: there from the start, as 0. seldom: once they were counted.
  CounterBy(const std::string& name, const std::string& help, const std::string& label,
            const std::vector<std::string>& values, const std::vector<std::string>& seldom = {});
  void Add(std::string_view value, double by = 1);

 private:
  const std::string name_, help_, label_;
  std::mutex mutex_;  // over the map, not over what is counted
  std::map<std::string, prometheus::Counter*, std::less<>> counters_;
};

// A value of each series at a moment, by its labels' values.
struct Reading {
  std::vector<std::string> label_values;
  double value = 0;
};

// Asked whenever it is looked at, and gone with its object. At most kMostReadings are told.
class Computed {
 public:
  enum class Type { kGauge, kCounter };
  // No reading: it is not known now, which is no 0.
  using Ask = std::function<std::vector<Reading>()>;
  Computed(std::string name, std::string help, std::vector<std::string> labels, Ask ask, Type type = Type::kGauge);
  ~Computed();
  Computed(const Computed&) = delete;
  Computed& operator=(const Computed&) = delete;

  static constexpr std::size_t kMostReadings = 1000;

 private:
  friend std::string ExpositionText();
  const std::string name_, help_;
  const std::vector<std::string> labels_;
  const Ask ask_;
  const Type type_;
};

// Gauges that somebody reads now and then (sampler.h), all at once.
class Readings {
 public:
  Readings(const std::string& name, const std::string& help, const std::vector<std::string>& labels);
  void Set(std::vector<Reading> readings);
  // They are not known any more.
  void Forget() { Set({}); }

 private:
  std::mutex mutex_;
  std::vector<Reading> readings_;
  const Computed computed_;
};

// All of it, in Prometheus' text format 0.0.4.
std::string ExpositionText();

// Limits of buckets for times that go from a look-up to a kernel's minutes.
std::vector<double> UsualSeconds();

}  // namespace sixpoint::runtime
