#include "server/lab/stability/report.h"

#include "common/text.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

namespace crumple::lab::stability {

namespace {

constexpr int kPanelWidth = 430, kHeight = 460;  // [px]

// A gnuplot string.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "''" : std::string(1, c);
  return out + "'";
}

// One panel: a rectangle and a letter a cell, on a grid of whole numbers.
void panel(std::ostream& out, const HeatMap& map, const Method& method, const CellGrid& grid, int index, int count) {
  const std::size_t nx = map.x.values.size(), ny = map.y.values.size();
  const double width = 1.0 / count;
  out << "set lmargin at screen " << (index + 0.2) * width << "\nset rmargin at screen " << (index + 0.97) * width
      << "\n"
      << "set tmargin at screen 0.91\nset bmargin at screen 0.34\nunset object\nunset label\n";
  for (std::size_t j = 0; j < ny; ++j)
    for (std::size_t i = 0; i < nx; ++i) {
      const CellState state = grid[j][i].state;
      out << "set object rect from " << i << "," << j << " to " << i + 1 << "," << j + 1 << " fc rgb '"
          << colour_of(state) << "' fs solid border lc rgb 'white' lw 1 behind\n";
      if (*letter_of(state))
        out << "set label '" << letter_of(state) << "' at " << i + 0.5 << "," << j + 0.5
            << " center font ',11' tc rgb '" << (state == CellState::not_finite ? "white" : "black") << "' front\n";
    }
  const auto tics = [&](const char* which, const Axis& axis, const char* more) {
    out << "set " << which << "tics (";
    for (std::size_t k = 0; k < axis.values.size(); ++k)
      out << (k ? ", " : "") << "'" << label(axis, static_cast<int>(k)) << "' " << k + 0.5;
    out << ") scale 0 nomirror textcolor rgb '#333333' font ',10' " << more << "\n";
  };
  const auto name = [](const Axis& axis) { return axis.name + (axis.unit.empty() ? "" : " [" + axis.unit + "]"); };
  tics("x", map.x, "rotate by -45");
  tics("y", map.y, "");
  out << "set xlabel '" << name(map.x) << "' offset 0,0.4\nset ylabel '" << name(map.y) << "' offset 1.5,0\nset title "
      << quoted(method.name) << " font ',12' offset 0,-0.5\n";
  if (index == 0) {  // the key, below all panels
    for (int s = 0; s < kCellStates; ++s) {
      const CellState state = static_cast<CellState>(s);
      const double box = 14.0 / (kPanelWidth * count);
      const double x = 16 + (s % 4) * 185, row = s / 4;
      const double at = x / (kPanelWidth * count);
      const double y = 0.085 - 0.055 * row;
      out << "set object rect from screen " << at << "," << y << " to screen " << at + box << "," << y + 14.0 / kHeight
          << " fc rgb '" << colour_of(state) << "' fs solid border lc rgb 'gray'\n";
      const std::string letter = *letter_of(state) ? std::string(" (") + letter_of(state) + ")" : "";
      out << "set label '" << name_of(state) << letter << "' at screen " << at + 1.4 * box << "," << y + 7.0 / kHeight
          << " left font ',11'\n";
    }
  }
  out << "plot [0:" << nx << "] [0:" << ny << "] NaN notitle\n";
}

// gnuplot's ids: letters, digits and underscores.
std::string svg_name(std::string key) {
  for (char& c : key)
    if (c == '-') c = '_';
  return key;
}

std::string script(const HeatMap& map, const Survey& survey, const std::filesystem::path& file, bool svg) {
  const auto methods = map.methods();
  const int count = static_cast<int>(methods.size());
  std::ostringstream out;
  out << "set terminal "
      << (svg ? text("svg font 'sans-serif,12' name '", svg_name(map.key), "'")
              : std::string("pngcairo font 'sans,12'"))
      << " size " << std::max(2, count) * kPanelWidth << "," << kHeight << " background rgb 'white'\nset output '"
      << file.string() << "'\n"
      << "set border lc rgb 'gray'\nset multiplot\n";
  for (int k = 0; k < count; ++k)
    panel(out, map, *methods[k], survey.grid(map, methods[k]->key), k, std::max(2, count));
  out << "unset multiplot\n";
  return out.str();
}

Result<void> run_gnuplot(const std::filesystem::path& script_file) {
  pid_t child;
  std::string program = "gnuplot", argument = script_file.string();
  char* words[] = {program.data(), argument.data(), nullptr};
  if (posix_spawnp(&child, "gnuplot", nullptr, nullptr, words, environ) != 0)
    return std::unexpected(
        Error{ErrorCode::failed_precondition, "gnuplot", "is not installed (Debian: gnuplot-nox); it draws the maps"});
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return std::unexpected(Error{ErrorCode::internal, "gnuplot", "failed on " + argument});
  return {};
}

}  // namespace

Result<std::map<std::string, std::string>> draw_maps(const Survey& survey, const std::filesystem::path& dir) {
  std::map<std::string, std::string> figures;
  const std::filesystem::path commands = dir / "figure.gp", drawing = dir / "figure.svg";
  Result<void> drawn;
  for (const HeatMap& map : all_maps()) {
    for (const bool svg : {false, true}) {
      if (!drawn) continue;
      std::ofstream(commands) << script(map, survey, svg ? drawing : dir / (map.key + ".png"), svg);
      drawn = run_gnuplot(commands);
    }
    if (!drawn) break;
    std::ifstream in(drawing);
    std::string content((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    if (const auto start = content.find("<svg"); start != std::string::npos) content.erase(0, start);
    figures[map.key] = content;
  }
  std::filesystem::remove(commands);
  std::filesystem::remove(drawing);
  if (!drawn) return std::unexpected(drawn.error());
  return figures;
}

}  // namespace crumple::lab::stability
