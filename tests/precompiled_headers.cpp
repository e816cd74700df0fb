// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

// The headers that tests share are compiled once, as those of this file.
