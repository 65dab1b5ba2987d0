hal can eds check eds-missing.eds
