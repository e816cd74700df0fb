// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Damaged files, for readers: a file's bytes after one to three random changes. Bytes are flipped, blocks of them
// overwritten with extreme numbers, the file is cut short, numbers in the text are replaced by huge, negative,
// fractional and non-finite ones (so that counts lie and ids miss), lines are dropped, repeated and swapped.

#pragma once

#include <random>
#include <string>

namespace ccslice::oracle {

std::string mutated(std::string bytes, std::mt19937& random);

}  // namespace ccslice::oracle
