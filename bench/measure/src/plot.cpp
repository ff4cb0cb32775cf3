#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "terrane/base/format_number.h"
#include "terrane/measure/fly.h"

namespace terrane {
namespace {

constexpr double kPanelWidth = 520.0;
constexpr double kPanelHeight = 150.0;
constexpr double kLeft = 74.0;
constexpr double kRight = 18.0;
constexpr double kTop = 34.0;
constexpr double kBottom = 28.0;
constexpr double kHeader = 78.0;
constexpr int kColumns = 2;

/// One small picture: a quantity over time.
struct Panel {
  std::string title;
  std::string unit;
  std::string color;
  std::function<std::optional<double>(const FlightFrame&)> value;
  std::optional<double> limit;  ///< drawn as a line of its own
  bool dots = false;            ///< single measurements instead of a line
  bool bytes = false;
};

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return out;
}

/// The step of 1, 2 or 5 times a power of ten that parts a range into at most `most` pieces.
double roundStep(double range, int most) {
  const double raw = range / most;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

std::string axisText(double value, const Panel& panel) {
  if (panel.bytes) return formatBytes(static_cast<uint64_t>(value));
  if (value >= 1e6) return fmt::format("{:.4g} M", value / 1e6);
  if (value >= 1e4) return fmt::format("{:.4g} k", value / 1e3);
  return fmt::format("{:.4g}", value);
}

std::string line(double x1, double y1, double x2, double y2, const char* style) {
  return fmt::format(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" class="{}"/>)", x1, y1, x2, y2,
                     style) +
         "\n";
}

std::string label(double x, double y, const char* style, const std::string& text) {
  return fmt::format(R"(<text x="{:.1f}" y="{:.1f}" class="{}">{}</text>)", x, y, style, escaped(text)) +
         "\n";
}

std::string drawPanel(const Panel& panel, const std::vector<FlightFrame>& frames, double x0, double y0) {
  // The scales: from nothing to a round number above all values.
  double highest = panel.limit.value_or(0.0);
  for (const FlightFrame& frame : frames) highest = std::max(highest, panel.value(frame).value_or(0.0));
  if (!(highest > 0.0)) highest = 1.0;
  const double step = roundStep(highest, 4);
  const double top = step * std::ceil(highest / step - 1e-9);
  const double duration = std::max(frames.empty() ? 0.0 : frames.back().seconds, 1e-3);
  const double width = kPanelWidth - kLeft - kRight;
  const double height = kPanelHeight - kTop - kBottom;
  const auto x = [&](double seconds) { return x0 + kLeft + width * seconds / duration; };
  const auto y = [&](double value) { return y0 + kTop + height * (1.0 - value / top); };

  std::string svg = label(x0 + kLeft, y0 + kTop - 14.0, "title", panel.title);
  if (!panel.unit.empty()) {
    svg += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" class="unit" text-anchor="end">{}</text>)",
                       x0 + kPanelWidth - kRight, y0 + kTop - 14.0, escaped(panel.unit)) +
           "\n";
  }
  for (double value = 0.0; value <= top * (1.0 + 1e-9); value += step) {
    svg += line(x(0.0), y(value), x(duration), y(value), value > 0.0 ? "grid" : "axis");
    svg += label(x(0.0) - 8.0, y(value) + 3.5, "ticky", axisText(value, panel));
  }
  const double secondsStep = roundStep(duration, 6);
  for (double seconds = 0.0; seconds <= duration * (1.0 + 1e-9); seconds += secondsStep) {
    svg += line(x(seconds), y(0.0), x(seconds), y(0.0) + 4.0, "axis");
    svg += label(x(seconds), y(0.0) + 17.0, "tickx", fmt::format("{:.4g} s", seconds));
  }

  // The values: dots where each was measured on its own, else a line over a tinted ground.
  std::string path;
  std::string dots;
  for (const FlightFrame& frame : frames) {
    const auto value = panel.value(frame);
    if (!value) continue;
    path += fmt::format("{}{:.1f},{:.1f}", path.empty() ? "M" : " L", x(frame.seconds), y(*value));
    dots += fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="2.6" fill="{}"/>)", x(frame.seconds), y(*value),
                        panel.color) +
            "\n";
  }
  if (panel.limit) svg += line(x(0.0), y(*panel.limit), x(duration), y(*panel.limit), "limit");
  if (panel.dots) return svg + dots;
  if (path.empty()) return svg;
  svg += fmt::format(R"(<path d="{} L{:.1f},{:.1f} L{:.1f},{:.1f} Z" fill="{}" fill-opacity="0.13"/>)", path,
                     x(duration), y(0.0), x(0.0), y(0.0), panel.color) +
         "\n";
  return svg +
         fmt::format(R"(<path d="{}" fill="none" stroke="{}" stroke-width="1.6" stroke-linejoin="round"/>)",
                     path, panel.color) +
         "\n";
}

}  // namespace

std::string plotReport(const FlightReport& report, const FlightHead& head, const FlyOptions& options) {
  const auto cost = [](auto member) {
    return [member](const FlightFrame& frame) {
      return std::optional<double>(static_cast<double>(frame.cost.*member));
    };
  };
  std::vector<Panel> panels = {
      {"Frame time", "ms", "#1f6f8b", cost(&FrameCost::timeMs), {}, false, false},
      {"Triangles", "", "#8a5a1c", cost(&FrameCost::triangles), {}, false, false},
      {"Patches", "", "#8a5a1c", cost(&FrameCost::patches), {}, false, false},
      {"Tiles in use", "", "#3f7d3a", cost(&FrameCost::tiles), {}, false, false},
      {"Read in the frame", "", "#6b4c9a", cost(&FrameCost::bytes), {}, false, true},
      {"Memory for tiles", "", "#6b4c9a", cost(&FrameCost::memoryBytes), {}, false, true},
      {"Deepest level", "", "#3f7d3a", cost(&FrameCost::deepestLevel), {}, false, false}};
  const bool measured = std::any_of(report.frames.begin(), report.frames.end(),
                                    [](const FlightFrame& f) { return f.error.has_value(); });
  if (measured) {
    panels.push_back({"Largest error, measured", "px; the line is tau", "#b23a48",
                      [](const FlightFrame& frame) {
                        return frame.error ? std::optional<double>(frame.error->maxPixels) : std::nullopt;
                      },
                      options.tauPixels, true, false});
  }

  const int rows = (static_cast<int>(panels.size()) + kColumns - 1) / kColumns;
  const double width = kColumns * kPanelWidth + 12.0;
  const double height = kHeader + rows * kPanelHeight + 12.0;
  std::string svg =
      fmt::format(
          R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0:.0f} {1:.0f}" width="{0:.0f}" height="{1:.0f}">)",
          width, height) +
      "\n";
  svg +=
      "<style>text{font-family:'Source Sans 3','Segoe UI','Helvetica Neue',Arial,sans-serif;fill:#333}"
      ".head{font-size:20px;font-weight:600;fill:#222}.sub{font-size:12.5px;fill:#666}"
      ".title{font-size:13px;font-weight:600}.unit{font-size:11px;fill:#777}"
      ".tickx{font-size:10.5px;text-anchor:middle;fill:#666}.ticky{font-size:10.5px;text-anchor:end;fill:#"
      "666}"
      ".grid{stroke:#e6e6e2}.axis{stroke:#999}.limit{stroke:#b23a48;stroke-width:1.2;stroke-dasharray:5 "
      "4}</style>\n";
  svg += fmt::format(R"(<rect width="{:.0f}" height="{:.0f}" fill="#fdfdfb"/>)", width, height) + "\n";
  svg += label(24.0, 36.0, "head", fmt::format("{} over {}", head.flight, head.dataset));
  svg += label(24.0, 57.0, "sub",
               fmt::format("{}, K = {}, tau = {:g} px, {} x {}, {}", head.surface, head.k, options.tauPixels,
                           options.width, options.height, head.renderer));
  for (size_t i = 0; i < panels.size(); ++i) {
    const double x0 = static_cast<double>(i % kColumns) * kPanelWidth;
    const double y0 = kHeader + static_cast<double>(i / kColumns) * kPanelHeight;
    svg += drawPanel(panels[i], report.frames, x0, y0);
  }
  return svg + "</svg>\n";
}

}  // namespace terrane
