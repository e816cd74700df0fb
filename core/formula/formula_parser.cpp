// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/formula_parser.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>

#include "core/base/choice_text.h"
#include "core/base/echo.h"
#include "core/base/similar_name.h"
#include "core/formula/formula.h"
#include "core/formula/formula_error.h"
#include "core/formula/program_builder.h"
#include "core/formula/tokens.h"
#include "core/formula/words.h"

namespace ccslice {

namespace {

using Value = ProgramBuilder::Value;

struct SignOperation {
  std::string_view sign;
  Op op;
};

struct NamedCandidate {
  std::string name;
};

std::string shown(const Token& token) {
  return token.kind == Token::Kind::kEnd ? "the end of the formula" : double_quoted(token.text);
}

class Parser {
 public:
  Parser(std::string_view text, std::span<const std::string> channels)
      : tokens_(tokens_of(text)), channels_(channels) {}

  ParsedFormula run() {
    if (next().kind == Token::Kind::kEnd) {
      fail(next(), "the formula is empty; write a number, a coordinate or the name of a channel");
    }
    const Value value = disjunction();
    if (next().is_sign(")")) fail(next(), "\")\" has no \"(\" before it; remove it");
    if (next().is_sign(",")) {
      fail(next(), "\",\" parts the values of functions only; decimal numbers are written with \".\"");
    }
    if (next().kind != Token::Kind::kEnd) {
      fail(next(), "an operator such as \"*\" is missing before " + shown(next()));
    }
    parsed_.program = builder_.finish(value);
    for (Instruction& instruction : parsed_.program.instructions) {
      if (instruction.op != Op::kInput) continue;
      std::uint16_t& input = instruction.operands[0].index;
      if (input >= kDistances) input = static_cast<std::uint16_t>(input - kDistances + parsed_.inputs.size());
    }
    return std::move(parsed_);
  }

 private:
  /// One level of nesting for as long as it lives.
  class Level {
   public:
    explicit Level(Parser& parser) : parser_(parser) {
      if (++parser_.depth_ > kMaxFormulaDepth) {
        parser_.fail(parser_.next(), "the formula is nested more than " + std::to_string(kMaxFormulaDepth) +
                                         " deep; take out parentheses, or make another field of a part of it");
      }
    }
    ~Level() { --parser_.depth_; }
    Level(const Level&) = delete;
    Level& operator=(const Level&) = delete;

   private:
    Parser& parser_;
  };

  const Token& next(std::size_t ahead = 0) const { return tokens_[std::min(at_ + ahead, tokens_.size() - 1)]; }
  Token take() { return tokens_[at_ + 1 < tokens_.size() ? at_++ : at_]; }
  bool accept(std::string_view sign) {
    if (!next().is_sign(sign)) return false;
    ++at_;
    return true;
  }
  bool accept_word(std::string_view name) {
    if (!next().is_name(name)) return false;
    ++at_;
    return true;
  }
  [[noreturn]] void fail(const Token& token, const std::string& complaint) const {
    throw FormulaError(token.column, complaint);
  }

  Value apply(const Token& token, Op op, const std::array<Value, 3>& operands) {
    count(token);
    return builder_.apply(op, operands);
  }
  void count(const Token& token) {
    if (++operations_ > kMaxFormulaOperations) {
      fail(token, "the formula has more than " + std::to_string(kMaxFormulaOperations) +
                      " operations; make another field of a part of it");
    }
  }

  Value disjunction() {
    Value value = conjunction();
    while (next().is_sign("||") || next().is_name("or")) {
      const Token sign = take();
      const Value other = conjunction();
      value = apply(sign, Op::kOr, {value, other, value});
    }
    return value;
  }

  Value conjunction() {
    Value value = negation();
    while (next().is_sign("&&") || next().is_name("and")) {
      const Token sign = take();
      const Value other = negation();
      value = apply(sign, Op::kAnd, {value, other, value});
    }
    return value;
  }

  Value negation() {
    const Token sign = next();
    if (!accept_word("not")) return comparison();
    const Level level(*this);
    const Value value = negation();
    return apply(sign, Op::kNot, {value, value, value});
  }

  /// The operation of a sign; those that compare the other way round swap their values.
  static std::optional<SignOperation> comparison_of(const Token& token) {
    constexpr std::array<SignOperation, 6> kComparisons = {{{"<", Op::kLess},
                                                            {"<=", Op::kLessOrEqual},
                                                            {">", Op::kLess},
                                                            {">=", Op::kLessOrEqual},
                                                            {"==", Op::kEqual},
                                                            {"!=", Op::kUnequal}}};
    const auto is_it = [&](const SignOperation& each) { return token.is_sign(each.sign); };
    const auto found = std::ranges::find_if(kComparisons, is_it);
    return found == kComparisons.end() ? std::nullopt : std::optional(*found);
  }

  Value comparison() {
    const Value left = sum();
    const auto compared = comparison_of(next());
    if (!compared) return left;
    const Token sign = take();
    const Value right = sum();
    if (comparison_of(next())) {
      fail(next(), "comparisons don't follow each other; write \"a < b and b < c\" instead of \"a < b < c\"");
    }
    const bool swapped = compared->sign.front() == '>';
    const Value a = swapped ? right : left, b = swapped ? left : right;
    return apply(sign, compared->op, {a, b, a});
  }

  Value sum() {
    Value value = product();
    while (next().is_sign("+") || next().is_sign("-")) {
      const Token sign = take();
      const Value other = product();
      value = apply(sign, sign.text == "+" ? Op::kAdd : Op::kSubtract, {value, other, value});
    }
    return value;
  }

  Value product() {
    Value value = signed_value();
    while (next().is_sign("*") || next().is_sign("/")) {
      const Token sign = take();
      const Value other = signed_value();
      value = apply(sign, sign.text == "*" ? Op::kMultiply : Op::kDivide, {value, other, value});
    }
    return value;
  }

  Value signed_value() {
    const Token sign = next();
    if (!accept("-") && !accept("+") && !accept("!")) return power();
    const Level level(*this);
    const Value value = signed_value();
    if (sign.text == "+") return value;
    return apply(sign, sign.text == "-" ? Op::kNegate : Op::kNot, {value, value, value});
  }

  Value power() {
    const Value base = primary();
    if (!next().is_sign("^")) return base;
    const Level level(*this);
    const Token sign = take();
    const Value exponent = signed_value();
    count(sign);
    return builder_.power(base, exponent);
  }

  Value primary() {
    const Token token = next();
    switch (token.kind) {
      case Token::Kind::kNumber: take(); return builder_.constant(token.number);
      case Token::Kind::kQuoted: take(); return channel_in_quotes(token);
      case Token::Kind::kName:
        if (!is_operator_word(token.text)) return named();
        break;
      case Token::Kind::kSign:
        if (token.text == "(") return in_parentheses();
        break;
      case Token::Kind::kEnd: break;
    }
    fail(token, "a value is missing before " + shown(token) + ": a number, a name or \"(\"");
  }

  Value in_parentheses() {
    const Level level(*this);
    const Token open = take();
    const Value value = disjunction();
    close(open);
    return value;
  }

  void close(const Token& open) {
    if (accept(")")) return;
    const bool comma = next().is_sign(",");
    fail(next(), "\")\" is missing before " + shown(next()) + ", for the \"(\" of column " +
                     std::to_string(open.column) + (comma ? "; decimal numbers are written with \".\"" : ""));
  }

  Value named() {
    const Token name = take();
    const FormulaFunction* function = find_function(name.text);
    const bool known = std::ranges::find(channels_, name.text) != channels_.end();
    if (is_distance_function(name.text)) return distance(name, known);
    if (next().is_sign("(")) {
      if (function != nullptr) return call(name, *function);
      fail_at_call(name, known);
    }
    if (function != nullptr) {
      fail(name, double_quoted(name.text) + " is a function; write its values behind it, in parentheses" +
                     (known ? ", or the channel's name in double quotes" : ""));
    }
    if (is_variable(name.text)) return variable(name.text);
    if (known) return channel(name.text);
    fail(name, "no channel or coordinate is called " + double_quoted(name.text) + hint(name.text, true));
  }

  static bool is_variable(std::string_view name) {
    return std::ranges::find(formula_variables(), name) != formula_variables().end();
  }

  [[noreturn]] void fail_at_call(const Token& name, bool known) const {
    if (known || is_variable(name.text)) {
      fail(next(), "\"*\" is missing behind " + double_quoted(name.text) + ", which is no function");
    }
    std::vector<NamedCandidate> functions;
    for (const FormulaFunction& each : formula_functions()) functions.push_back({each.name});
    for (const std::string& each : distance_functions()) functions.push_back({each});
    const std::string near = hint_of_name(functions, name.text, '"');
    fail(name, "no function is called " + double_quoted(name.text) +
                   (near.empty() ? "; write one of " + choice_text(functions) : near));
  }

  Value call(const Token& name, const FormulaFunction& function) {
    const Level level(*this);
    const Token open = take();
    std::vector<Value> values;
    if (!next().is_sign(")")) {
      do {
        values.push_back(disjunction());
      } while (accept(","));
    }
    if (values.size() < function.least || values.size() > function.most) fail_at_values(name, function, values.size());
    close_call(open);
    if (function.least == 1) return apply(name, function.op, {values[0], values[0], values[0]});
    if (function.least == 3) return apply(name, function.op, {values[0], values[1], values[2]});
    Value value = values[0];
    for (std::size_t i = 1; i < values.size(); ++i) value = apply(name, function.op, {value, values[i], value});
    return value;
  }

  Value distance(const Token& name, bool is_channel) {
    const bool is_call = next().is_sign("(") && next(1).kind == Token::Kind::kNumber && next(2).is_sign(")");
    if (!is_call || !(next(1).number >= kLeastReachMm && next(1).number <= kMostReachMm)) {
      fail(name, double_quoted(name.text) +
                     " takes how far the distance is wanted, a number of mm from 0.001 to 1e6, as in \"" + name.text +
                     "(2)\"" + (is_channel ? "; write the channel's name in double quotes" : ""));
    }
    take();
    const FormulaDistance read{name.text == distance_functions()[1], take().number};
    take();
    count(name);
    const auto found = std::ranges::find(parsed_.distances, read);
    const auto index = static_cast<std::uint16_t>(found - parsed_.distances.begin());
    if (found == parsed_.distances.end()) parsed_.distances.push_back(read);
    return builder_.input(static_cast<std::uint16_t>(kDistances + index));
  }

  void close_call(const Token& open) {
    if (accept(")")) return;
    fail(next(), "\")\" or \",\" is missing before " + shown(next()) + ", for the \"(\" of column " +
                     std::to_string(open.column));
  }

  [[noreturn]] void fail_at_values(const Token& name, const FormulaFunction& function, std::size_t given) const {
    const std::string least = std::to_string(function.least);
    const bool several = function.least != 1;
    fail(name, double_quoted(name.text) + " takes " + least + (function.most != function.least ? " or more" : "") +
                   (several ? " values, " : " value, ") + std::to_string(given) + (given == 1 ? " is" : " are") +
                   " given");
  }

  Value variable(const std::string& name) {
    if (name == "pi") return builder_.constant(std::numbers::pi);
    parsed_.uses_place = true;
    if (name == "z") return builder_.coordinate(Op::kZ);
    if (name == "x") return builder_.coordinate(Op::kX);
    if (name == "y") return builder_.coordinate(Op::kY);
    const Value x = builder_.coordinate(Op::kX), y = builder_.coordinate(Op::kY);
    if (name == "theta") return builder_.apply(Op::kAngle, y, x);
    const Value square = builder_.apply(Op::kAdd, builder_.apply(Op::kSquare, x), builder_.apply(Op::kSquare, y));
    return builder_.apply(Op::kSquareRoot, square);
  }

  Value channel_in_quotes(const Token& name) {
    if (std::ranges::find(channels_, name.text) != channels_.end()) return channel(name.text);
    fail(name, "no channel is called " + double_quoted(name.text) + hint(name.text, false));
  }

  Value channel(const std::string& name) {
    const auto found = std::ranges::find(parsed_.inputs, name);
    const auto index = static_cast<std::uint16_t>(found - parsed_.inputs.begin());
    if (found == parsed_.inputs.end()) parsed_.inputs.push_back(name);
    return builder_.input(index);
  }

  /// The nearest name, or else all channels.
  std::string hint(const std::string& name, bool variables) const {
    std::vector<NamedCandidate> known;
    for (const std::string& each : channels_) known.push_back({each});
    std::vector<NamedCandidate> candidates = known;
    if (variables) {
      for (const std::string& each : formula_variables()) candidates.push_back({each});
    }
    const std::string near = hint_of_name(candidates, name, '"');
    if (!near.empty()) return near;
    return known.empty() ? "; there are no channels to read" : "; the channels are " + echoed_names(known, '"');
  }

  static constexpr double kLeastReachMm = 1e-3, kMostReachMm = 1e6;
  static constexpr std::uint16_t kDistances = 1 << 15;  // Numbers of such inputs, while channels are being found.

  std::vector<Token> tokens_;
  std::span<const std::string> channels_;
  std::size_t at_ = 0, depth_ = 0, operations_ = 0;
  ProgramBuilder builder_;
  ParsedFormula parsed_;
};

}  // namespace

ParsedFormula parse_formula(std::string_view text, std::span<const std::string> channels) {
  if (text.size() > kMaxFormulaBytes) {
    throw FormulaError(1, "the formula has " + std::to_string(text.size()) + " bytes, more than " +
                              std::to_string(kMaxFormulaBytes) + "; make other fields of parts of it");
  }
  return Parser(text, channels).run();
}

}  // namespace ccslice
