#pragma once

#include <string>
#include <string_view>

namespace brachy {

// Before a parser allocates memory for a mesh file, these compare the declared sizes with the content, so that the
// parser never reads a truncated, malformed or inconsistent file. `name` is the file's, for the message.
// Errors: UserError, one line, also where there are no faces.

/// Takes filling bytes (blanks, line ends, zeros, Ctrl-Z, or less than a triangle) from behind the last triangle of an
/// STL, and writes the words of a text STL in small letters.
void make_stl_plain(std::string& bytes);

/// Binary: the triangle count against the size. Text: every token of every facet.
void check_stl_bytes(std::string_view bytes, const std::string& name);

/// The header, and that the data holds every entry of every element and list.
void check_ply_bytes(std::string_view bytes, const std::string& name);

/// Puts a line's end before the data of a binary PLY that begins with that byte: assimp takes one there for the
/// header's and skips it. `bytes` have been checked.
void keep_first_byte(std::string& ply);

/// An OBJ file declares no sizes: checks only that it is text.
void check_obj_bytes(std::string_view bytes, const std::string& name);

/// Blanks every line of an OBJ but vertices and faces: materials, groups and the like make a mesh of their own each in
/// assimp, which takes time that grows with the square of their number. The lines keep their numbers.
void keep_surface_lines(std::string& obj);

}  // namespace brachy
