#include "services/runtime/metrics.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <algorithm>

namespace sixpoint::runtime {
namespace {

constexpr char kOther[] = "other";

// Never destroyed: a thread may count until the process ends.
prometheus::Registry& Registry() {
  static auto* const registry = new prometheus::Registry();
  return *registry;
}

struct AllComputed {
  std::mutex mutex;
  std::vector<const Computed*> all;
};
AllComputed& ComputedOnes() {
  static auto* const computed = new AllComputed();
  return *computed;
}

prometheus::Counter* CounterOf(const std::string& name, const std::string& help, const MetricLabels& labels) {
  return &prometheus::BuildCounter().Name(name).Help(help).Register(Registry()).Add(labels);
}

prometheus::ClientMetric MetricOf(const std::vector<std::string>& labels, const Reading& reading, Computed::Type type) {
  prometheus::ClientMetric metric;
  for (std::size_t i = 0; i < std::min(labels.size(), reading.label_values.size()); ++i)
    metric.label.push_back({labels[i], reading.label_values[i]});
  (type == Computed::Type::kGauge ? metric.gauge.value : metric.counter.value) = reading.value;
  return metric;
}

}  // namespace

Counter::Counter(const std::string& name, const std::string& help, const MetricLabels& labels)
    : counter_(CounterOf(name, help, labels)) {}
void Counter::Add(double by) { counter_->Increment(by); }

Gauge::Gauge(const std::string& name, const std::string& help, const MetricLabels& labels)
    : gauge_(&prometheus::BuildGauge().Name(name).Help(help).Register(Registry()).Add(labels)) {}
void Gauge::Set(double value) { gauge_->Set(value); }
void Gauge::Add(double by) { gauge_->Increment(by); }

Histogram::Histogram(const std::string& name, const std::string& help, const std::vector<double>& limits,
                     const MetricLabels& labels)
    : histogram_(&prometheus::BuildHistogram().Name(name).Help(help).Register(Registry()).Add(labels, limits)) {}
void Histogram::Observe(double value) { histogram_->Observe(value); }

CounterBy::CounterBy(const std::string& name, const std::string& help, const std::string& label,
                     const std::vector<std::string>& values, const std::vector<std::string>& seldom)
    : name_(name), help_(help), label_(label) {
  for (const std::string& value : values) counters_[value] = CounterOf(name, help, {{label, value}});
  for (const std::string& value : seldom) counters_.emplace(value, nullptr);
  counters_.emplace(kOther, nullptr);
}

void CounterBy::Add(std::string_view value, double by) {
  prometheus::Counter* counted = nullptr;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    auto found = counters_.find(value);
    if (found == counters_.end()) found = counters_.find(kOther);
    if (found->second == nullptr) found->second = CounterOf(name_, help_, {{label_, found->first}});
    counted = found->second;
  }
  counted->Increment(by);
}

Computed::Computed(std::string name, std::string help, std::vector<std::string> labels, Ask ask, Type type)
    : name_(std::move(name)), help_(std::move(help)), labels_(std::move(labels)), ask_(std::move(ask)), type_(type) {
  const std::lock_guard<std::mutex> lock(ComputedOnes().mutex);
  ComputedOnes().all.push_back(this);
}

Computed::~Computed() {
  const std::lock_guard<std::mutex> lock(ComputedOnes().mutex);
  auto& all = ComputedOnes().all;
  all.erase(std::remove(all.begin(), all.end(), this), all.end());
}

Readings::Readings(const std::string& name, const std::string& help, const std::vector<std::string>& labels)
    : computed_(name, help, labels, [this] {
        const std::lock_guard<std::mutex> lock(mutex_);
        return readings_;
      }) {}

void Readings::Set(std::vector<Reading> readings) {
  const std::lock_guard<std::mutex> lock(mutex_);
  readings_ = std::move(readings);
}

std::string ExpositionText() {
  std::vector<prometheus::MetricFamily> families = Registry().Collect();
  {
    const std::lock_guard<std::mutex> lock(ComputedOnes().mutex);
    for (const Computed* computed : ComputedOnes().all) {
      std::vector<Reading> readings = computed->ask_();
      if (readings.empty()) continue;
      if (readings.size() > Computed::kMostReadings) readings.resize(Computed::kMostReadings);
      prometheus::MetricFamily family;
      family.name = computed->name_;
      family.help = computed->help_;
      family.type =
          computed->type_ == Computed::Type::kGauge ? prometheus::MetricType::Gauge : prometheus::MetricType::Counter;
      for (const Reading& reading : readings)
        family.metric.push_back(MetricOf(computed->labels_, reading, computed->type_));
      families.push_back(std::move(family));
    }
  }
  // A family of which nothing was counted yet has nothing to say.
  families.erase(
      std::remove_if(families.begin(), families.end(), [](const auto& family) { return family.metric.empty(); }),
      families.end());
  return prometheus::TextSerializer().Serialize(families);
}

std::vector<double> UsualSeconds() {
  return {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30, 60, 120};
}

}  // namespace sixpoint::runtime
