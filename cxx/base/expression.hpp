// Functions of time that are given as text, "1e4*min(t/0.1, 1)", and compiled once.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace cairn {

// An expression of the time t [s]: numbers, + - * / ^ (or **), brackets, t, pi, e and the functions
//   sin cos tan asin acos atan sinh cosh tanh exp log sqrt abs sign floor (x), min max pow atan2 mod (x, y),
//   clip(x, lowest, highest), where(x, a, b): a for x > 0 else b, and
//   table(x, x1, y1, x2, y2, ...): piecewise linear between rising x, constant before the first and after the last.
// Evaluation neither allocates nor fails: a root of a negative number is no number.
class Expression {
public:
  Expression() = default; // 0
  // Throws Error that names the place of the fault and the word that is due there.
  explicit Expression(std::string_view text);
  double operator()(double t) const;
  const std::string& text() const { return text_; }

private:
  friend class ExpressionParser;
  struct Step {
    int kind;
    double number;
    std::size_t table;
  };
  struct Table {
    std::vector<double> x, y;
  };
  static double interpolate(const Table& table, double x);
  std::string text_ = "0";
  std::vector<Step> steps_; // in the order of evaluation, on a stack
  std::vector<Table> tables_;
};

} // namespace cairn
