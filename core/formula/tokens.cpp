// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/tokens.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <system_error>
#include <utility>

#include "core/base/utf8.h"
#include "core/formula/formula_error.h"

namespace ccslice {

namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool begins_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool continues_name(char c) { return begins_name(c) || is_digit(c); }
bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

class Tokenizer {
 public:
  explicit Tokenizer(std::string_view text) : text_(text) {}

  std::vector<Token> run() {
    std::vector<Token> tokens;
    while (true) {
      while (at_ < text_.size() && is_space(text_[at_])) ++at_;
      tokens.push_back(next());
      if (tokens.back().kind == Token::Kind::kEnd) return tokens;
    }
  }

 private:
  /// Characters are counted, not bytes.
  std::size_t column(std::size_t at) const {
    const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; };
    return at - static_cast<std::size_t>(std::count_if(text_.begin(), text_.begin() + at, continues)) + 1;
  }
  [[noreturn]] void fail(std::size_t at, const std::string& complaint) const {
    throw FormulaError(column(at), complaint);
  }
  char peek(std::size_t ahead = 0) const { return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0'; }
  std::string_view since(std::size_t begin) const { return text_.substr(begin, at_ - begin); }

  Token next() {
    if (at_ == text_.size()) return {Token::Kind::kEnd, "", 0, column(at_)};
    if (is_digit(peek()) || (peek() == '.' && is_digit(peek(1)))) return number();
    if (begins_name(peek())) return name();
    if (peek() == '"') return quoted_name();
    return sign();
  }

  void skip_digits() {
    while (is_digit(peek())) ++at_;
  }

  Token number() {
    const std::size_t begin = at_;
    skip_digits();
    if (peek() == '.') ++at_;
    skip_digits();
    const std::size_t sign = peek(1) == '+' || peek(1) == '-' ? 1 : 0;
    if ((peek() == 'e' || peek() == 'E') && is_digit(peek(1 + sign))) {
      at_ += 1 + sign;
      skip_digits();
    }
    Token token{Token::Kind::kNumber, std::string(since(begin)), 0, column(begin)};
    if (begins_name(peek())) fail(at_, "\"*\" is missing behind the number " + double_quoted(token.text));
    if (peek() == '.') fail(at_, "the number " + double_quoted(token.text) + " has a second decimal point; remove one");
    const auto parsed = std::from_chars(token.text.data(), token.text.data() + token.text.size(), token.number);
    if (parsed.ec != std::errc()) {
      fail(begin, "the number " + double_quoted(token.text) +
                      " is too large or too small: write one of 1e-307 to 1e308, or 0");
    }
    return token;
  }

  Token name() {
    const std::size_t begin = at_;
    while (continues_name(peek())) ++at_;
    return {Token::Kind::kName, std::string(since(begin)), 0, column(begin)};
  }

  Token quoted_name() {
    const std::size_t begin = at_++;
    std::string name;
    while (true) {
      if (at_ == text_.size()) fail(begin, "the name's closing double quote is missing");
      const char c = text_[at_++];
      if (c == '"') {
        if (peek() != '"') break;
        ++at_;
      }
      name += c;
    }
    return {Token::Kind::kQuoted, std::move(name), 0, column(begin)};
  }

  Token sign() {
    constexpr std::array<std::string_view, 17> kSigns = {"<=", ">=", "==", "!=", "&&", "||", "+", "-", "*",
                                                         "/",  "^",  "(",  ")",  ",",  "<",  ">", "!"};
    const std::string_view rest = text_.substr(at_);
    if (rest.starts_with("**")) fail(at_, "\"**\" is no operator; powers are written with \"^\"");
    for (const std::string_view sign : kSigns) {
      if (!rest.starts_with(sign)) continue;
      const std::size_t begin = at_;
      at_ += sign.size();
      return {Token::Kind::kSign, std::string(sign), 0, column(begin)};
    }
    fail_at_stranger();
  }

  [[noreturn]] void fail_at_stranger() const {
    constexpr std::array<std::pair<char, const char*>, 10> kRemedies = {{
        {'=', "\"=\" compares nothing; equality is written \"==\""},
        {'&', "\"&\" is no operator; write \"and\""},
        {'|', "\"|\" is no operator; write \"or\", or abs(a) for the absolute value"},
        {'%', "\"%\" is no operator; remainders are written mod(a, b)"},
        {'[', "\"[\" is no part of formulas; write \"(\""},
        {']', "\"]\" is no part of formulas; write \")\""},
        {'{', "\"{\" is no part of formulas; write \"(\""},
        {'}', "\"}\" is no part of formulas; write \")\""},
        {'?', "\"?\" is no operator; choices are written if(condition, a, b)"},
        {'\'', "\"'\" is no part of formulas; names are written in double quotes"},
    }};
    for (const auto& [character, remedy] : kRemedies) {
      if (text_[at_] == character) fail(at_, remedy);
    }
    const std::size_t length = std::max<std::size_t>(utf8_sequence_length(text_.substr(at_)), 1);
    fail(at_, double_quoted(text_.substr(at_, length)) +
                  " is no part of formulas; names with other characters than letters, digits and _ are written in "
                  "double quotes");
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

std::vector<Token> tokens_of(std::string_view formula) { return Tokenizer(formula).run(); }

}  // namespace ccslice
