hal can eds check eds-syntax.eds
