// expect: could not convert .*JobIdTag.*PieceIdTag
#include "base/ids.h"

void book(veneer::PieceId piece);

void wrong(veneer::JobId job) { book(job); }
