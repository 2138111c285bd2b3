#include "expression.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>

#include "call.hpp"

namespace cairn {

namespace {

constexpr int deepest = 64; // numbers on the stack, brackets within brackets

enum Kind { number, time_of_step, negate, add, subtract, multiply, divide, power, first_function };

struct Function {
  const char* name;
  int arguments;
  double (*of)(const double*);
};

const Function functions[] = {
    {"sin", 1, [](const double* x) { return std::sin(*x); }},
    {"cos", 1, [](const double* x) { return std::cos(*x); }},
    {"tan", 1, [](const double* x) { return std::tan(*x); }},
    {"asin", 1, [](const double* x) { return std::asin(*x); }},
    {"acos", 1, [](const double* x) { return std::acos(*x); }},
    {"atan", 1, [](const double* x) { return std::atan(*x); }},
    {"sinh", 1, [](const double* x) { return std::sinh(*x); }},
    {"cosh", 1, [](const double* x) { return std::cosh(*x); }},
    {"tanh", 1, [](const double* x) { return std::tanh(*x); }},
    {"exp", 1, [](const double* x) { return std::exp(*x); }},
    {"log", 1, [](const double* x) { return std::log(*x); }},
    {"sqrt", 1, [](const double* x) { return std::sqrt(*x); }},
    {"abs", 1, [](const double* x) { return std::abs(*x); }},
    {"sign", 1, [](const double* x) { return double((*x > 0) - (*x < 0)); }},
    {"floor", 1, [](const double* x) { return std::floor(*x); }},
    {"min", 2, [](const double* x) { return std::min(x[0], x[1]); }},
    {"max", 2, [](const double* x) { return std::max(x[0], x[1]); }},
    {"pow", 2, [](const double* x) { return std::pow(x[0], x[1]); }},
    {"atan2", 2, [](const double* x) { return std::atan2(x[0], x[1]); }},
    {"mod", 2, [](const double* x) { return x[0] - x[1] * std::floor(x[0] / x[1]); }},
    {"clip", 3, [](const double* x) { return std::min(std::max(x[0], x[1]), x[2]); }},
    {"where", 3, [](const double* x) { return x[0] > 0 ? x[1] : x[2]; }},
};
constexpr int table_kind = first_function + int(std::size(functions));

bool of_a_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || (c >= '0' && c <= '9');
}

} // namespace

// Descent through sums, products, signs, powers; steps come out in the order of evaluation.
class ExpressionParser {
public:
  ExpressionParser(std::string_view text, Expression& out) : text_(text), out_(out) {
    sum();
    if (at_ < text_.size()) refuse("an operator or the end");
  }

private:
  [[noreturn]] void refuse(const std::string& due) {
    std::string found = "its end";
    if (at_ < text_.size()) found.assign(1, '\'').append(text_.substr(at_, 12)).append(1, '\'');
    throw Error("the expression '" + std::string(text_) + "' has " + found + " at character " +
                std::to_string(at_ + 1) + ", where " + due + " is due");
  }
  void skip() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n')) ++at_;
  }
  bool take(std::string_view sign) {
    skip();
    if (text_.substr(at_, sign.size()) != sign) return false;
    at_ += sign.size();
    return true;
  }
  void due(std::string_view sign) {
    if (take(sign)) return;
    std::string quoted(1, '\'');
    quoted.append(sign).append(1, '\'');
    refuse(quoted);
  }
  void step(int kind, int takes, double value = 0, std::size_t table = 0) {
    out_.steps_.push_back({kind, value, table});
    if ((depth_ += 1 - takes) > deepest) refuse("a shorter expression");
  }
  void nest() {
    if (++nested_ > deepest) refuse("a shorter expression");
  }

  void sum() {
    nest();
    product();
    for (;;) {
      if (take("+"))
        product(), step(add, 2);
      else if (take("-"))
        product(), step(subtract, 2);
      else
        break;
    }
    --nested_;
  }
  void product() {
    signed_power();
    for (;;) {
      skip();
      if (text_.substr(at_, 2) != "**" && take("*"))
        signed_power(), step(multiply, 2);
      else if (take("/"))
        signed_power(), step(divide, 2);
      else
        return;
    }
  }
  void signed_power() {
    nest();
    if (take("-"))
      signed_power(), step(negate, 1);
    else if (take("+"))
      signed_power();
    else if (primary(); take("**") || take("^"))
      signed_power(), step(power, 2);
    --nested_;
  }
  double literal() {
    skip();
    double value = 0;
    const char *first = text_.data() + at_, *last = text_.data() + text_.size();
    const auto [end, fault] = std::from_chars(first, last, value);
    if (fault != std::errc() || !std::isfinite(value)) refuse("a number");
    at_ += std::size_t(end - first);
    return value;
  }
  void primary() {
    skip();
    if (take("(")) {
      sum();
      due(")");
    } else if (at_ < text_.size() && (text_[at_] == '.' || (text_[at_] >= '0' && text_[at_] <= '9'))) {
      step(number, 0, literal());
    } else {
      word();
    }
  }
  void word() {
    const std::size_t begin = at_;
    std::size_t end = at_;
    while (end < text_.size() && of_a_word(text_[end])) ++end;
    const std::string_view name = text_.substr(begin, end - begin);
    if (name == "t") {
      at_ = end;
      return step(time_of_step, 0);
    }
    if (name == "pi" || name == "e") {
      at_ = end;
      return step(number, 0, name == "pi" ? std::numbers::pi : std::numbers::e);
    }
    if (name == "table") {
      at_ = end;
      return table();
    }
    for (std::size_t k = 0; k < std::size(functions); ++k) {
      if (name != functions[k].name) continue;
      at_ = end;
      due("(");
      for (int argument = 0; argument < functions[k].arguments; ++argument) {
        if (argument > 0) due(",");
        sum();
      }
      due(")");
      return step(first_function + int(k), functions[k].arguments);
    }
    refuse("a number, t, pi, e or a function (sin, exp, min, clip, where, table, ...)");
  }
  void table() {
    due("(");
    sum();
    Expression::Table rows;
    while (take(",")) {
      const auto constant = [&] {
        const bool negative = take("-");
        const double value = literal();
        return negative ? -value : value;
      };
      const double x = constant();
      if (!rows.x.empty() && !(x > rows.x.back())) refuse("a number above the last, since a table rises,");
      rows.x.push_back(x);
      due(",");
      rows.y.push_back(constant());
    }
    if (rows.x.empty()) refuse("', x, y' of a row of the table");
    due(")");
    out_.tables_.push_back(std::move(rows));
    step(table_kind, 1, 0, out_.tables_.size() - 1);
  }

  std::string_view text_;
  Expression& out_;
  std::size_t at_ = 0;
  int depth_ = 0, nested_ = 0;
};

Expression::Expression(std::string_view text) : text_(text) { ExpressionParser(text_, *this); }

double Expression::interpolate(const Table& table, double x) {
  if (std::isnan(x)) return x;
  const auto after = std::size_t(std::upper_bound(table.x.begin(), table.x.end(), x) - table.x.begin());
  if (after == 0) return table.y.front();
  const std::size_t j = after - 1;
  if (after == table.x.size() || !(x > table.x[j])) return table.y[j];
  const double slope = (table.y[after] - table.y[j]) / (table.x[after] - table.x[j]);
  return slope * (x - table.x[j]) + table.y[j];
}

double Expression::operator()(double t) const {
  double stack[deepest + 1] = {};
  double* top = stack; // of the last number
  for (const Step& s : steps_) {
    switch (s.kind) {
    case number: *++top = s.number; break;
    case time_of_step: *++top = t; break;
    case negate: *top = -*top; break;
    case add: --top, *top += top[1]; break;
    case subtract: --top, *top -= top[1]; break;
    case multiply: --top, *top *= top[1]; break;
    case divide: --top, *top /= top[1]; break;
    case power: --top, *top = std::pow(top[0], top[1]); break;
    case table_kind: *top = interpolate(tables_[s.table], *top); break;
    default: {
      const Function& f = functions[s.kind - first_function];
      top -= f.arguments - 1;
      *top = f.of(top);
    }
    }
  }
  return steps_.empty() ? 0 : *top;
}

} // namespace cairn
