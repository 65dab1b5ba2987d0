hal can eds check eds-object.eds
