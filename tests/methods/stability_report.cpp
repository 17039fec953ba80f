#include <algorithm>
#include <cstdio>
#include <ostream>

#include "tests/methods/stability.h"

namespace fstop {
namespace {

constexpr int kColumn = 132;  // SVG units
constexpr int kRow = 22;
constexpr int kLeft = 230;
constexpr int kTop = 92;

template <typename... Values>
std::string text(const char* format, Values... values) {
  char line[500];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

// Regimes or methods in the order in which they first appear.
std::vector<std::string> names(const std::vector<StabilityCell>& cells,
                               std::string StabilityCell::*member) {
  std::vector<std::string> result;
  for (const StabilityCell& cell : cells) {
    if (std::ranges::count(result, cell.*member) == 0) result.push_back(cell.*member);
  }
  return result;
}

// Colours that stay apart in grey and to colour-blind eyes (Okabe & Ito 2008), made lighter.
const char* color_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::held:
      return "#8fd3bf";
    case Verdict::over:
      return "#f6e7a8";
    case Verdict::refused:
      return "#e3e3e3";
    default:
      return "#d55e00";
  }
}

std::string content(const StabilityCell& cell) {
  if (cell.verdict == Verdict::refused) return "refused";
  if (cell.verdict == Verdict::failed) return "failed";
  if (cell.verdict == Verdict::not_finite) return "not finite";
  return text("%.2g of %.2g", cell.true_error, cell.bound);
}

void put(std::ostream& out, int x, int y, const char* anchor, const std::string& words,
         const char* style = "") {
  out << text(R"(<text x="%d" y="%d" text-anchor="%s"%s>)", x, y, anchor, style) << words
      << "</text>\n";
}

void put_legend(std::ostream& out) {
  int x = kLeft;
  const std::pair<Verdict, const char*> kinds[] = {{Verdict::held, "bound held, under the target"},
                                                   {Verdict::over, "bound held, above the target"},
                                                   {Verdict::refused, "refused"},
                                                   {Verdict::broken, "bound broken"}};
  for (const auto& [verdict, words] : kinds) {
    out << text(R"(<rect x="%d" y="38" width="14" height="14" fill="%s"/>)", x, color_of(verdict))
        << '\n';
    put(out, x + 20, 50, "start", words);
    x += 36 + 7 * static_cast<int>(std::string_view(words).size());
  }
}

}  // namespace

void print_stability(std::ostream& out, const std::vector<StabilityCell>& cells) {
  for (const StabilityCell& c : cells) {
    out << text("%-34s %-20s %-11s %-16s true %.4f +- %.4f  bound %.4f of %.4f  %.160s\n",
                c.regime.c_str(), c.method.c_str(), std::string(verdict_name(c.verdict)).c_str(),
                c.taken.c_str(), c.true_error, c.scatter, c.bound, c.target, c.note.c_str());
  }
}

void write_stability_csv(std::ostream& out, const std::vector<StabilityCell>& cells) {
  out << "regime,method,verdict,taken,target,bound,true,scatter,note\n";
  for (const StabilityCell& c : cells) {
    std::string note = c.note;
    std::ranges::replace(note, '"', '\'');
    out << '"' << c.regime << "\"," << c.method << ',' << verdict_name(c.verdict) << ',' << c.taken
        << text(",%.4g,%.4g,%.4g,%.4g,", c.target, c.bound, c.true_error, c.scatter) << '"' << note
        << "\"\n";
  }
}

void write_stability_svg(std::ostream& out, const std::vector<StabilityCell>& cells) {
  const std::vector<std::string> regimes = names(cells, &StabilityCell::regime);
  const std::vector<std::string> methods = names(cells, &StabilityCell::method);
  const int width = std::max(kLeft + kColumn * static_cast<int>(methods.size()) + 10, 1000);
  const int height = kTop + kRow * static_cast<int>(regimes.size()) + 10;
  out << text(
             R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 %d %d" font-family="sans-serif" font-size="13">)",
             width, height)
      << '\n'
      << text(R"(<rect width="%d" height="%d" fill="white"/>)", width, height) << '\n';
  put(out, 10, 24, "start",
      text("Where each method holds its bound: true error of bound, target %g",
           cells.empty() ? 0.0 : cells.front().target),
      R"( font-size="16")");
  put_legend(out);
  for (std::size_t m = 0; m < methods.size(); ++m) {
    put(out, kLeft + kColumn * static_cast<int>(m) + kColumn / 2, kTop - 10, "middle", methods[m],
        R"( font-weight="bold")");
  }
  for (std::size_t r = 0; r < regimes.size(); ++r) {
    const int y = kTop + kRow * static_cast<int>(r);
    put(out, kLeft - 10, y + 15, "end", regimes[r]);
    for (const StabilityCell& cell : cells) {
      if (cell.regime != regimes[r]) continue;
      const auto column = std::ranges::find(methods, cell.method) - methods.begin();
      const int x = kLeft + kColumn * static_cast<int>(column);
      out << text(R"(<rect x="%d" y="%d" width="%d" height="%d" fill="%s"/>)", x + 1, y + 1,
                  kColumn - 2, kRow - 2, color_of(cell.verdict))
          << '\n';
      put(out, x + kColumn / 2, y + 15, "middle", content(cell));
    }
  }
  out << "</svg>\n";
}

}  // namespace fstop
