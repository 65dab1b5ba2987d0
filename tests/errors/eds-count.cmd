hal can eds check eds-count.eds
